"""Threads, and the locks that they wait for."""

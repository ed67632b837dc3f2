"""Threads and the locks that they wait for, how much memory there is, and an orderly start under interrupts."""

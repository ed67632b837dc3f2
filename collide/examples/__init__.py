"""Runnable examples: `python -m collide.examples.NAME`, each a program of its own. They need the extra `examples`."""

"""The formulas, each once: as plain Python, for Numba's scalars and for lanes.

collision.py    what a collision does to velocities, the impulse that it transfers, in any number of dimensions
impact.py       when two balls will touch
exact.py        sums and products with their rounding errors, which keep differences of nearly equal terms
sincos.py       sine and cosine with the same bits on every machine
"""

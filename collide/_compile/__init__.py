"""All that knows Numba and LLVM, their private interfaces above all: a new Numba is this folder's work.

versions.py       which Numba and NumPy are taken
options.py        the one place where compile options are decided
kernel.py         a kernel: one signature, compiled at its first call, by a thread of its own
cache.py          compiled kernels on disk
lanes.py          the type of several numbers that move together, and what looks across them
elementwise.py    what formulas use beyond operators
components.py     what is done to each component of vectors
arrays.py         what a kernel asks of its arrays: how they lie, and whether they overlap
memory.py         lanes in and out of memory, however columns lie
words.py          words of memory, which threads may change at once
team.py           the threads that kernels share
pieces.py         a kernel's range in pieces, for any thread
allocator.py      the functions by which NumPy allocates arrays whose memory is kept
kept_memory.py    memory for large results: what dies is kept for the next
gather.py         what the search for contacts loads and stores
"""

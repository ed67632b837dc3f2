"""Batches of pairs.

forms.py        ONE table of forms: columns, results, the step; a new form is an entry here, and its public functions
loop.py         what a kernel does: loads, the step, the look at what is invalid, stores
execution.py    a call, as the arguments lie or converted, on as many threads as it is worth
arguments.py    what arguments must be, and the words for those that are not; errors.py has those for invalid pairs
blocks.py       arrays that a kernel cannot take as they lie
results.py      arrays that are given for the results
chunks.py       a call over Dask arrays, a task a chunk
vectors.py      vectors along the last axis of arrays
"""

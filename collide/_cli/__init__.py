"""What only the command line needs; its arguments and exit statuses are in collide/__main__.py.

demo.py             `collide demo`
kernels.py          `collide compile`
bench.py            `collide bench`
against_numpy.py    random pairs in each form, and what a NumPy user would write for them
limit.py            the kernels that move the bytes of a form only: the memory limit
status_line.py      what is being done, on a terminal
"""

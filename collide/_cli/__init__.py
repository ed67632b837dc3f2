"""What only the command line needs; its subcommands and exit statuses are in collide/__main__.py.

resolve.py          `collide resolve`: its arguments, which file is of which format, what may be replaced
demo.py             `collide demo`
kernels.py          `collide compile`
bench.py            `collide bench`
against_numpy.py    random pairs in each form, and what a NumPy user would write for them
limit.py            the kernels that move the bytes of a form only: the memory limit
messages.py         what the command line says, and where
status_line.py      what is being done, on a terminal
"""

"""What only the command line needs; its subcommands and exit statuses are in collide/__main__.py.

resolve.py    `collide resolve`: its arguments, which file is of which format, what may be replaced
demo.py       `collide demo`
limit.py      the kernels that move the bytes of a form only: the memory limit
messages.py   what the command line says, and where
"""

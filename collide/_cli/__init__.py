"""What only the command line needs; its arguments and exit statuses are in collide/__main__.py.

demo.py     `collide demo`
limit.py    the kernels that move the bytes of a form only: the memory limit
"""

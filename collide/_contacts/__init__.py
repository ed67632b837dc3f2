"""Ball states: which balls touch, and what they do to each other.

state.py        what is asked of their arguments
search.py       the search as a whole
at_once.py      the same in one compiled call, for few balls
layout.py       how fine its grids are, and how large
torus.py        where a place of the plane is on a grid
grid.py         the kernels: balls sorted into a grid, and compared with those around them
in_order.py     the kernels: pairs resolved one after another, contacts or with normals of their own
resolution.py   a resolution as a whole
walls.py        balls at the walls of the box
"""

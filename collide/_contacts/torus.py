"""Where a place in the plane is on a grid, which is a torus: both directions come back to where they began.

A grid has so many slots, columns times rows, whatever the plane has of cells; cells that are far apart share a slot.
After a turn around the columns a row goes on `twist` rows farther on. This is a torus of 4 columns, 3 rows and twist 1;
its slots are numbered row by row:

    cell_x     0  1  2  3    4  5  6  7    8  9 10 11   12 ...
    cell_y 2   8  9 10 11    0  1  2  3    4  5  6  7    8
           1   4  5  6  7    8  9 10 11    0  1  2  3    4
           0   0  1  2  3    4  5  6  7    8  9 10 11    0

Cells share a slot if they differ by a vector of the lattice that (columns, -twist) and (0, rows) span. The twist keeps
balls on a line from sharing the few slots of one row.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from .._compile.elementwise import select
from .._compile.options import formula

# Cells of slack for the rounding of positions in units of cells: up to FAR of them that is less than 2**-12. Balls
# farther out have cells of a power of two, and no rounding.
LEEWAY, FAR = 2.0**-10, 2.0**40


@formula
def wrap(x: Any, length: Any) -> Any:
    """The position in a periodic box; a side of length 0 is open."""
    return x % length if length > 0.0 and not 0.0 <= x < length else x


@formula
def touching(dx: Any, dy: Any, reach: Any, lx: Any, ly: Any) -> Any:
    """Whether balls that lie dx and dy apart, or their nearest images in the box, are within reach of each other."""
    dx, dy = abs(dx), abs(dy)
    if lx > 0.0:
        dx = select(dx < lx - dx, dx, lx - dx)
    if ly > 0.0:
        dy = select(dy < ly - dy, dy, ly - dy)
    return dx * dx + dy * dy <= reach * reach


@formula
def _fold(cell: Any, cells: Any) -> Any:
    """The cell on the torus; exact for a cell of any size."""
    if not 0.0 <= cell < cells:
        if abs(cell) < 2.0**52:
            cell -= cells * np.floor(cell / cells)
        else:
            cell = cell % cells
    return cell


@formula
def column_and_row(cell_x: Any, cell_y: Any, columns: Any, rows: Any, twist: Any) -> tuple[Any, Any]:
    """Where a cell of the plane is on the torus."""
    column = _fold(cell_x, columns)
    if twist > 0.0 and column != cell_x:
        # The number of columns is a power of two then, so that this is exact for a cell of any size.
        cell_y = _fold(cell_y, rows) + twist * _fold((cell_x - column) / columns, rows)
    return column, _fold(cell_y, rows)


@formula
def span(q: Any, reach: Any) -> tuple[Any, Any]:
    """The first cell that `reach` cells to both sides of q touch, and how many they touch.

    One more where the rounding of q may have hidden it.
    """
    low, high = np.floor(q - (reach + LEEWAY)), np.floor(q + (reach + LEEWAY))
    return low, high - low + 1.0

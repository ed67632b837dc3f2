"""What one would use, a file each, on the same arrays: from a case it makes a call, which then is timed.

What a contestant can do bears the same name in each file: `batch` resolves pairs, `search` finds contacts, `table`
resolves the pairs of a file into another. One that is
not installed, or has no such case, says so by `MissingError`. All of them write to the arrays that they are given,
except NumPy and JAX.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest
from cases import Call, Case

from . import (
    by_hand,
    c,
    duckdb,
    itself,
    jax,
    matscipy,
    memory_limit,
    numexpr,
    numpy_expression,
    plain_copy,
    polars,
    prange,
    prange_same_formula,
    pymunk,
    scipy,
    taichi,
)
from .missing import MissingError

# By the names that saved results and report.py know them by.
BATCHES: dict[str, Callable[[Case], Call]] = {
    "collide": itself.batch,
    "bytes only": memory_limit.batch,
    "prange": prange.batch,
    "prange, same formula": prange_same_formula.batch,
    "C": c.batch,
    "NumPy": numpy_expression.batch,
    "numexpr": numexpr.batch,
    "JAX": jax.batch,
    "Taichi": taichi.batch,
    "pymunk": pymunk.batch,
}
SEARCHES: dict[str, Callable[..., Any]] = {
    "SciPy's cKDTree.query_pairs": scipy.search,
    "matscipy's neighbour_list": matscipy.search,
}
WALLS: dict[str, Callable[..., int]] = {"NumPy": numpy_expression.walls, "a loop of Numba's": by_hand.walls}
# A folder has a rival of its own, as those that are asked for an expression read none.
TABLES: dict[str, Callable[..., Any]] = {
    "Polars": polars.table,
    "DuckDB": duckdb.table,
    "a plain copy": plain_copy.table,
}


def entered(name: str, make: Callable[..., Any], *case: Any) -> Any:
    """What a contestant makes of a case; a test of one that is missing is skipped by its name."""
    try:
        return make(*case)
    except MissingError as reason:
        pytest.skip(f"{name}: {reason}")

"""The calls that people make: columns or rows, of pairs in the plane, or rows of three; and what they would write.

Of each a call of collide, the loop that a Numba user would write over the same arrays, and the expression of a NumPy
user. Who gives no `out` drops the results of one call as those of the next are there, as a simulation does.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numba
import numpy as np
from cases import Array, Case, make_case
from contestants import numpy_expression, prange
from contestants.itself import FUNCTIONS
from rounds import Timed

import collide


class Way(NamedTuple):
    """The same pairs in the same arrays by three."""

    collide: Timed
    prange: Timed
    NumPy: Timed


def _of_rows(case: Case) -> tuple[Array, ...]:
    """m1, m2, and v1, v2, n as rows."""
    m1, m2, *components = case.columns
    d = len(components) // 3
    return m1, m2, *(np.stack(components[k : k + d], axis=-1) for k in range(0, 3 * d, d))


def _keeping(call: Timed) -> Timed:
    """The call, whose results live until those of the next are there."""
    kept = [call()]

    def again() -> None:
        kept[0] = call()

    return again


def _on_threads(case: Case, call: Timed) -> Timed:
    def again() -> object:
        numba.set_num_threads(case.threads)
        return call()

    return again


def columns_with_out(case: Case) -> Way:
    return Way(
        lambda: collide.resolve_2d(*case.columns, out=case.out),
        _on_threads(case, lambda: prange.plane(*case.columns, *case.out)),
        lambda: numpy_expression.plane(*case.columns),
    )


def columns(case: Case) -> Way:
    def by_prange() -> list[Array]:
        u = [np.empty(case.n) for _ in range(4)]
        prange.plane(*case.columns, *u)
        return u

    return Way(
        _keeping(lambda: collide.resolve_2d(*case.columns)),
        _keeping(_on_threads(case, by_prange)),
        _keeping(lambda: numpy_expression.plane(*case.columns)),
    )


def rows_with_out(case: Case) -> Way:
    given, loop = _of_rows(case), LOOPS[case.form]
    u = np.empty_like(given[2]), np.empty_like(given[2])
    loop(*given, *u)
    for found in (collide.resolve(*given), numpy_expression.rows(*given)):
        np.testing.assert_allclose(found, u, rtol=1e-12, atol=1e-11)
    return Way(
        lambda: collide.resolve(*given, out=u),
        _on_threads(case, lambda: loop(*given, *u)),
        lambda: numpy_expression.rows(*given),
    )


def rows(case: Case) -> Way:
    given = _of_rows(case)

    def by_prange() -> list[Array]:
        u = [np.empty_like(given[2]) for _ in range(2)]
        LOOPS[case.form](*given, *u)
        return u

    return Way(
        _keeping(lambda: collide.resolve(*given)),
        _keeping(_on_threads(case, by_prange)),
        _keeping(lambda: numpy_expression.rows(*given)),
    )


def rows_in_place(case: Case) -> Way:
    """Their columns, over which the results go: at each call the same balls collide again."""
    m1, m2, v1, v2, n = _of_rows(case)
    theirs, numpys, loop = (v1.copy(), v2.copy()), (v1.copy(), v2.copy()), LOOPS[case.form]

    def by_numpy() -> None:
        numpys[0][:], numpys[1][:] = numpy_expression.rows(m1, m2, *numpys, n)

    return Way(
        lambda: FUNCTIONS[case.form](m1, m2, *v1.T, *v2.T, *n.T, out=(*v1.T, *v2.T)),
        _on_threads(case, lambda: loop(m1, m2, *theirs, n, *theirs)),
        by_numpy,
    )


LOOPS = {"2d": prange.rows, "3d": prange.rows_of_three}
# The form, and what makes the calls of a case.
WAYS: dict[str, tuple[str, Callable[[Case], Way]]] = {
    "columns, out given": ("2d", columns_with_out),
    "columns": ("2d", columns),
    "rows, out given": ("2d", rows_with_out),
    "rows": ("2d", rows),
    "rows in place": ("2d", rows_in_place),
    "rows of three, out given": ("3d", rows_with_out),
    "rows of three": ("3d", rows),
    "rows of three in place": ("3d", rows_in_place),
}


def make(way: str, n: int) -> Way:
    """The calls of n pairs, for as many threads as collide has at this moment."""
    form, calls = WAYS[way]
    return calls(make_case(form, n))

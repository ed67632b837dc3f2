"""The memory limit: kernels that load every column and store every output of a batch, and compute next to nothing.

Yardsticks for the demo and the benchmarks, under the same facade and threads as the real kernels.
"""

from __future__ import annotations

from typing import Any

from ._jit import formula
from ._kernels import CARTESIAN, POLAR, make_form
from ._lanes import LINE
from ._memory import is_usual, lead, load, store


@formula
def _move(columns: Any, outputs: Any, scalars: Any, start: int, stop: int) -> tuple[int, int]:
    """Three or four sums a pair, only because the compiler leaves out a load whose value goes nowhere."""
    width = LINE // outputs[0].itemsize
    head = lead(outputs, start)
    usual = is_usual(columns)
    k = start
    n = min(head if head > 0 else width, stop - start)
    while k < stop:
        values = load(columns, scalars, k, n, usual)
        sums = (values[0] + values[1], values[2] + values[3], values[4] + values[5], values[6] + values[-2])
        store(outputs, k, n, sums, head >= 0)
        k += n
        n = min(width, stop - k)
    return 0, -1


def _bytes_2d(  # type: ignore[no-untyped-def]  # compiled only
    m1, m2, v1x, v1y, v2x, v2y, nx, ny, e, u1x, u1y, u2x, u2y, scalars, start, stop, approaching, nan
):
    return _move((m1, m2, v1x, v1y, v2x, v2y, nx, ny, e), (u1x, u1y, u2x, u2y), scalars, start, stop)


def _bytes_polar(  # type: ignore[no-untyped-def]  # compiled only
    m1, m2, v1, theta1, v2, theta2, phi, e, u1x, u1y, u2x, u2y, scalars, start, stop, approaching, nan
):
    return _move((m1, m2, v1, theta1, v2, theta2, phi, e), (u1x, u1y, u2x, u2y), scalars, start, stop)


CARTESIAN_LIMIT = make_form(_bytes_2d, CARTESIAN.columns, CARTESIAN.outputs)
POLAR_LIMIT = make_form(_bytes_polar, POLAR.columns, POLAR.outputs)

"""The memory limit: kernels that load every column and store every output of a batch, and compute next to nothing.

Yardsticks for the demo and the benchmarks, under the same facade and threads as the real kernels.
"""

from __future__ import annotations

from typing import Any

from .._compile.lanes import LINE
from .._compile.memory import is_usual, lead, load, store
from .._compile.options import formula
from .._pairs.forms import FORM_1D, FORM_2D, FORM_POLAR, IMPACT, make_form
from .._pairs.loop import STREAM_BYTES

# A few sums a pair, only because the compiler leaves out a load whose value goes nowhere.


@formula
def _sums_on_line(values: Any) -> Any:
    return values[0] + values[1], values[2] + values[3]


@formula
def _sums_in_plane(values: Any) -> Any:
    return values[0] + values[1], values[2] + values[3], values[4] + values[5], values[6] + values[-2]


@formula
def _sum_of_impact(values: Any) -> Any:
    return (values[0] + values[1] + values[2] + values[3] + values[4],)


@formula
def _move(sums: Any, columns: Any, outputs: Any, scalars: Any, start: int, stop: int) -> tuple[int, int]:
    width = LINE // outputs[0].itemsize
    head = lead(outputs, start)
    streaming = head >= 0 and outputs[0].nbytes >= STREAM_BYTES
    usual = is_usual(columns)
    k = start
    n = min(head if head > 0 else width, stop - start)
    while k < stop:
        store(outputs, k, n, sums(load(columns, scalars, k, n, usual)), streaming)
        k += n
        n = min(width, stop - k)
    return 0, -1


def _bytes_1d(  # type: ignore[no-untyped-def]  # compiled only
    m1, m2, v1, v2, e, u1, u2, scalars, start, stop, approaching, nan
):
    return _move(_sums_on_line, (m1, m2, v1, v2, e), (u1, u2), scalars, start, stop)


def _bytes_2d(  # type: ignore[no-untyped-def]  # compiled only
    m1, m2, v1x, v1y, v2x, v2y, nx, ny, e, u1x, u1y, u2x, u2y, scalars, start, stop, approaching, nan
):
    columns, outputs = (m1, m2, v1x, v1y, v2x, v2y, nx, ny, e), (u1x, u1y, u2x, u2y)
    return _move(_sums_in_plane, columns, outputs, scalars, start, stop)


def _bytes_polar(  # type: ignore[no-untyped-def]  # compiled only
    m1, m2, v1, theta1, v2, theta2, phi, e, u1x, u1y, u2x, u2y, scalars, start, stop, approaching, nan
):
    columns, outputs = (m1, m2, v1, theta1, v2, theta2, phi, e), (u1x, u1y, u2x, u2y)
    return _move(_sums_in_plane, columns, outputs, scalars, start, stop)


def _bytes_impact(  # type: ignore[no-untyped-def]  # compiled only
    dx, dy, dvx, dvy, distance, t, scalars, start, stop, approaching, nan
):
    return _move(_sum_of_impact, (dx, dy, dvx, dvy, distance), (t,), scalars, start, stop)


LIMIT_1D = make_form(_bytes_1d, FORM_1D.columns, FORM_1D.outputs)
LIMIT_2D = make_form(_bytes_2d, FORM_2D.columns, FORM_2D.outputs)
LIMIT_POLAR = make_form(_bytes_polar, FORM_POLAR.columns, FORM_POLAR.outputs)
LIMIT_IMPACT = make_form(_bytes_impact, IMPACT.columns, IMPACT.outputs)

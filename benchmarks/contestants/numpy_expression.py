"""What a NumPy user would write. Always on one thread; it allocates its results, as its users would have it do.

Of pairs by their components the demo has the same expressions.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from cases import Call, Case

from collide._cli import against_numpy

line, plane, space = against_numpy.line, against_numpy.plane, against_numpy.space  # for others in this folder as well


def rows(m1: Any, m2: Any, v1: Any, v2: Any, n: Any) -> Any:
    q = 2.0 * ((v1 - v2) * n).sum(axis=-1) / ((m1 + m2) * (n * n).sum(axis=-1))
    return v1 - (m2 * q)[:, None] * n, v2 + (m1 * q)[:, None] * n


def walls(x: Any, y: Any, vx: Any, vy: Any, radius: float, side: float) -> int:
    """For a square: balls that are at a wall and move outwards turn around."""
    count = 0
    for place, v in ((x, vx), (y, vy)):
        out = ((place - radius <= 0.0) & (v < 0.0)) | ((place + radius >= side) & (v > 0.0))
        v[out] *= -1.0
        count += int(np.count_nonzero(out))
    return count


def impact(dx: Any, dy: Any, dvx: Any, dvy: Any, distance: Any) -> Any:
    """The textbook's discriminant, which loses near a graze what collide keeps."""
    square = dvx * dvx + dvy * dvy
    return _first_root(dx * dvx + dy * dvy, square, dx * dx + dy * dy - distance * distance)


def impact_3d(dx: Any, dy: Any, dz: Any, dvx: Any, dvy: Any, dvz: Any, distance: Any) -> Any:
    square = dvx * dvx + dvy * dvy + dvz * dvz
    return _first_root(dx * dvx + dy * dvy + dz * dvz, square, dx * dx + dy * dy + dz * dz - distance * distance)


def _first_root(b: Any, square: Any, gap: Any) -> Any:
    under = b * b - square * gap
    t = (-b - np.sqrt(np.maximum(under, 0.0))) / square
    return (np.where((b < 0.0) & (under >= 0.0), np.maximum(t, 0.0), np.inf),)


def batch(case: Case) -> Call:
    functions: dict[str, Callable[..., Any]] = {
        **against_numpy.EXPRESSIONS,
        "impact": impact,
        "impact_3d": impact_3d,
    }
    function = functions[case.form]
    return lambda: function(*case.columns)

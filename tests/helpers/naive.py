"""The slow, independent oracle: the collision seen from the centre of mass, at 50 digits. Imports nothing of collide.

In that frame the pair has no momentum, so each ball simply leaves with -e times its velocity along the line of centres.
"""

from collections.abc import Sequence
from typing import Any

import mpmath
import numpy as np
from mpmath import mp, mpf

mp.dps = 50
EPS = 2.0**-52


def _centre(m1: Any, m2: Any, v1: list[Any], v2: list[Any]) -> list[Any]:
    """The velocity of the centre of mass; an immovable ball is the centre itself."""
    if mpmath.isinf(m1):
        return v1
    if mpmath.isinf(m2):
        return v2
    return [(m1 * a + m2 * b) / (m1 + m2) for a, b in zip(v1, v2, strict=True)]


def _reflect(v: list[Any], centre: list[Any], n: list[Any], e: Any) -> list[Any]:
    square = sum(x * x for x in n)
    along = sum((a - c) * x for a, c, x in zip(v, centre, n, strict=True)) / square
    return [a - (1 + e) * along * x for a, x in zip(v, n, strict=True)]


def _collide(m1: Any, m2: Any, v1: list[Any], v2: list[Any], n: list[Any], e: Any) -> list[Any]:
    centre = _centre(m1, m2, v1, v2)
    return [*_reflect(v1, centre, n, e), *_reflect(v2, centre, n, e)]


def resolve_1d(m1: Any, m2: Any, v1: Any, v2: Any, e: Any = 1.0) -> list[Any]:
    m1, m2, v1, v2, e = map(mpf, (m1, m2, v1, v2, e))
    return _collide(m1, m2, [v1], [v2], [mpf(1)], e)


def resolve_2d(m1: Any, m2: Any, v1x: Any, v1y: Any, v2x: Any, v2y: Any, nx: Any, ny: Any, e: Any = 1.0) -> list[Any]:
    m1, m2, v1x, v1y, v2x, v2y, nx, ny, e = map(mpf, (m1, m2, v1x, v1y, v2x, v2y, nx, ny, e))
    return _collide(m1, m2, [v1x, v1y], [v2x, v2y], [nx, ny], e)


def resolve_3d(*pair: Any) -> list[Any]:
    return _in_space(*pair)[0]


def _in_space(
    m1: Any,
    m2: Any,
    v1x: Any,
    v1y: Any,
    v1z: Any,
    v2x: Any,
    v2y: Any,
    v2z: Any,
    nx: Any,
    ny: Any,
    nz: Any,
    e: Any = 1.0,
) -> tuple[list[Any], list[Any], list[Any]]:
    """The velocities after, those before, and n."""
    m1, m2, e = map(mpf, (m1, m2, e))
    v1, v2, n = ([*map(mpf, vector)] for vector in ((v1x, v1y, v1z), (v2x, v2y, v2z), (nx, ny, nz)))
    return _collide(m1, m2, v1, v2, n, e), [*v1, *v2], n


def components_of(v: Any, theta: Any) -> tuple[Any, Any]:
    with mp.workdps(50 + max(0, int(mpmath.log10(abs(mpf(theta)) + 1)))):
        return mpf(v) * mp.cos(mpf(theta)), mpf(v) * mp.sin(mpf(theta))


def resolve_polar(m1: Any, m2: Any, v1: Any, theta1: Any, v2: Any, theta2: Any, phi: Any, e: Any = 1.0) -> list[Any]:
    before = *components_of(v1, theta1), *components_of(v2, theta2)
    return resolve_2d(m1, m2, *before, *components_of(1, phi), e)


def impulse_2d(m1: Any, m2: Any, v1x: Any, v1y: Any, v2x: Any, v2y: Any, nx: Any, ny: Any, e: Any = 1.0) -> Any:
    """What the lighter ball's velocity changes by, times its mass, along n/|n| and as seen by ball 2."""
    m1, m2, v1x, v1y, v2x, v2y, nx, ny, e = map(mpf, (m1, m2, v1x, v1y, v2x, v2y, nx, ny, e))
    u1x, u1y, u2x, u2y = resolve_2d(m1, m2, v1x, v1y, v2x, v2y, nx, ny, e)
    change = [v1x - u1x, v1y - u1y] if m1 <= m2 else [u2x - v2x, u2y - v2y]
    return min(m1, m2) * (change[0] * nx + change[1] * ny) / mp.sqrt(nx * nx + ny * ny)


def impulse_3d(*pair: Any) -> Any:
    """The same in space."""
    u, v, n = _in_space(*pair)
    m1, m2 = map(mpf, pair[:2])
    change = [b - a for a, b in zip(u[:3], v[:3], strict=True)]
    change = change if m1 <= m2 else [a - b for a, b in zip(u[3:], v[3:], strict=True)]
    return min(m1, m2) * sum(a * b for a, b in zip(change, n, strict=True)) / mp.sqrt(sum(x * x for x in n))


def time_of_impact(*pair: Any) -> Any:
    """The smaller root of the quadratic, as a textbook has it, at enough digits that nothing is lost.

    In the plane and in space: the components of d, those of w, and the distance.
    """
    with mp.workdps(150):
        *components, distance = map(mpf, pair)
        d, w = components[: len(components) // 2], components[len(components) // 2 :]
        a, b = sum(x * x for x in w), sum(x * y for x, y in zip(d, w, strict=True))
        c = sum(x * x for x in d) - distance**2
        if b >= 0 or b**2 < a * c:
            return mpf("inf")
        return max(mpf(0), (-b - mp.sqrt(b**2 - a * c)) / a)


def error_in_eps(got: Sequence[Any], exact: Sequence[Any], before: Sequence[Any]) -> float:
    """The largest error of the components, in 2**-52 of the largest component before or after."""
    scale = max(abs(mpf(x)) for x in (*before, *exact))
    if scale == 0:
        return 0.0 if all(g == 0 for g in got) else np.inf
    return float(max(abs(mpf(float(g)) - x) for g, x in zip(got, exact, strict=True)) / scale / EPS)


def velocities_before(name: str, row: Sequence[Any]) -> Sequence[Any]:
    """The components before the collision, of a row of the arguments of the function of that name."""
    if name == "resolve_polar":
        return [*components_of(*row[2:4]), *components_of(*row[4:6])]
    return row[2 : {"resolve_1d": 4, "resolve_2d": 6, "resolve_3d": 8}[name]]


def row_error(name: str, row: Sequence[Any], got: Sequence[Any]) -> float:
    return error_in_eps(got, globals()[name](*row), velocities_before(name, row))


def worst(job: tuple[str, Any, Any]) -> tuple[float, Any]:
    """The largest error of some rows, and which it is of."""
    name, rows, results = job
    return max((row_error(name, row, got), row) for row, got in zip(rows, results, strict=True))


def ulps(got: Any, exact: Any) -> Any:
    """The distance of a float64 from an exact value, in units in the last place of the exact value."""
    if exact == 0:
        return abs(got) / 5e-324
    exponent = max(int(mpmath.frexp(abs(exact))[1]) - 53, -1074)
    return float(abs(mpf(float(got)) - exact) * mpf(2) ** -exponent)


def find_contacts(x: Any, y: Any, radius: Any, box: Any = None, margin: float = 0.0) -> Any:
    """Every pair tried, in the arithmetic that the documentation states; the pairs in order."""
    x, y = np.asarray(x, np.float64), np.asarray(y, np.float64)
    radius = np.broadcast_to(np.asarray(radius, np.float64), x.shape)
    square = np.zeros((x.size, x.size))
    with np.errstate(over="ignore", under="ignore"):
        for c, side in zip((x, y), box or (None, None), strict=True):
            if side is not None:
                c = np.where((c >= 0) & (c < side), c, c % side)
            d = abs(c - c[:, None])
            if side is not None:
                d = np.minimum(d, side - d)
            square += d * d
        reach = radius + radius[:, None] + margin
        return np.argwhere(np.triu(square <= reach * reach, 1))

"""What a NumPy user would write. Always on one thread; it allocates its results, as its users would have it do."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from cases import Call, Case


def line(m1: Any, m2: Any, v1: Any, v2: Any) -> Any:
    q = 2.0 * (v1 - v2) / (m1 + m2)
    return v1 - m2 * q, v2 + m1 * q


def plane(m1: Any, m2: Any, v1x: Any, v1y: Any, v2x: Any, v2y: Any, nx: Any, ny: Any) -> Any:
    q = 2.0 * ((v1x - v2x) * nx + (v1y - v2y) * ny) / ((m1 + m2) * (nx * nx + ny * ny))
    return v1x - m2 * q * nx, v1y - m2 * q * ny, v2x + m1 * q * nx, v2y + m1 * q * ny


def space(
    m1: Any, m2: Any, v1x: Any, v1y: Any, v1z: Any, v2x: Any, v2y: Any, v2z: Any, nx: Any, ny: Any, nz: Any
) -> Any:
    closing = (v1x - v2x) * nx + (v1y - v2y) * ny + (v1z - v2z) * nz
    q = 2.0 * closing / ((m1 + m2) * (nx * nx + ny * ny + nz * nz))
    j1, j2 = m2 * q, m1 * q
    return v1x - j1 * nx, v1y - j1 * ny, v1z - j1 * nz, v2x + j2 * nx, v2y + j2 * ny, v2z + j2 * nz


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


def polar(m1: Any, m2: Any, v1: Any, theta1: Any, v2: Any, theta2: Any, phi: Any) -> Any:
    """The textbook's formula as it stands."""
    along1, along2 = v1 * np.cos(theta1 - phi), v2 * np.cos(theta2 - phi)
    across1, across2 = v1 * np.sin(theta1 - phi), v2 * np.sin(theta2 - phi)
    after1 = ((m1 - m2) * along1 + 2.0 * m2 * along2) / (m1 + m2)
    after2 = ((m2 - m1) * along2 + 2.0 * m1 * along1) / (m1 + m2)
    c, s, c90, s90 = np.cos(phi), np.sin(phi), np.cos(phi + np.pi / 2), np.sin(phi + np.pi / 2)
    return (
        after1 * c + across1 * c90,
        after1 * s + across1 * s90,
        after2 * c + across2 * c90,
        after2 * s + across2 * s90,
    )


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
        "1d": line,
        "2d": plane,
        "3d": space,
        "polar": polar,
        "impact": impact,
        "impact_3d": impact_3d,
    }
    function = functions[case.form]
    return lambda: function(*case.columns)

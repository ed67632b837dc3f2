"""Random pairs in each form, and what a NumPy user would write for them: of the demo and the benchmarks."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from .._typing import Array


def random_pairs(form: str, n: int) -> list[Array]:
    """The columns of n pairs, without a restitution. Those on a line and in polar form are those in the plane."""
    rng = np.random.default_rng(0)
    if form == "3d":
        normal = rng.normal(size=(3, n))
        normal /= np.sqrt((normal * normal).sum(axis=0))
        return [*rng.uniform(0.1, 10.0, (2, n)), *rng.normal(0.0, 3.0, (6, n)), *normal]
    m1, m2, v1, v2 = (rng.uniform(0.1, 10.0, n) for _ in range(4))
    theta1, theta2, phi = (rng.uniform(-np.pi, np.pi, n) for _ in range(3))
    if form == "polar":
        return [m1, m2, v1, theta1, v2, theta2, phi]
    if form == "1d":
        return [m1, m2, v1 * np.cos(theta1), v2 * np.cos(theta2)]
    vectors = [(v1, theta1), (v2, theta2), (1.0, phi)]
    return [m1, m2, *(length * f(angle) for length, angle in vectors for f in (np.cos, np.sin))]


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


EXPRESSIONS: dict[str, Callable[..., Any]] = {"1d": line, "2d": plane, "3d": space, "polar": polar}

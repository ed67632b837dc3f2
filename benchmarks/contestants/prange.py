"""Numba's parallel loop over the plain formula, in polar form with libm: the fastest that prange can be."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numba
import numpy as np
from cases import Array, Call, Case

OPTIONS = {"error_model": "numpy", "parallel": True}


@numba.njit(**OPTIONS)
def line(m1, m2, v1, v2, u1, u2):
    for k in numba.prange(m1.size):
        q = 2.0 * (v1[k] - v2[k]) / (m1[k] + m2[k])
        u1[k], u2[k] = v1[k] - m2[k] * q, v2[k] + m1[k] * q


@numba.njit(**OPTIONS)
def plane(m1, m2, v1x, v1y, v2x, v2y, nx, ny, u1x, u1y, u2x, u2y):
    for k in numba.prange(m1.size):
        dx, dy = nx[k], ny[k]
        q = 2.0 * ((v1x[k] - v2x[k]) * dx + (v1y[k] - v2y[k]) * dy) / ((m1[k] + m2[k]) * (dx * dx + dy * dy))
        j1, j2 = m2[k] * q, m1[k] * q
        u1x[k], u1y[k] = v1x[k] - j1 * dx, v1y[k] - j1 * dy
        u2x[k], u2y[k] = v2x[k] + j2 * dx, v2y[k] + j2 * dy


@numba.njit(**OPTIONS)
def space(m1, m2, v1x, v1y, v1z, v2x, v2y, v2z, nx, ny, nz, u1x, u1y, u1z, u2x, u2y, u2z):
    for k in numba.prange(m1.size):
        dx, dy, dz = nx[k], ny[k], nz[k]
        closing = (v1x[k] - v2x[k]) * dx + (v1y[k] - v2y[k]) * dy + (v1z[k] - v2z[k]) * dz
        q = 2.0 * closing / ((m1[k] + m2[k]) * (dx * dx + dy * dy + dz * dz))
        j1, j2 = m2[k] * q, m1[k] * q
        u1x[k], u1y[k], u1z[k] = v1x[k] - j1 * dx, v1y[k] - j1 * dy, v1z[k] - j1 * dz
        u2x[k], u2y[k], u2z[k] = v2x[k] + j2 * dx, v2y[k] + j2 * dy, v2z[k] + j2 * dz


@numba.njit(**OPTIONS)
def rows(m1, m2, v1, v2, n, u1, u2):
    for k in numba.prange(m1.size):
        dx, dy = n[k, 0], n[k, 1]
        ax, ay, bx, by = v1[k, 0], v1[k, 1], v2[k, 0], v2[k, 1]
        q = 2.0 * ((ax - bx) * dx + (ay - by) * dy) / ((m1[k] + m2[k]) * (dx * dx + dy * dy))
        j1, j2 = m2[k] * q, m1[k] * q
        u1[k, 0], u1[k, 1] = ax - j1 * dx, ay - j1 * dy
        u2[k, 0], u2[k, 1] = bx + j2 * dx, by + j2 * dy


@numba.njit(**OPTIONS)
def rows_of_three(m1, m2, v1, v2, n, u1, u2):
    for k in numba.prange(m1.size):
        dx, dy, dz = n[k, 0], n[k, 1], n[k, 2]
        ax, ay, az, bx, by, bz = v1[k, 0], v1[k, 1], v1[k, 2], v2[k, 0], v2[k, 1], v2[k, 2]
        closing = (ax - bx) * dx + (ay - by) * dy + (az - bz) * dz
        q = 2.0 * closing / ((m1[k] + m2[k]) * (dx * dx + dy * dy + dz * dz))
        j1, j2 = m2[k] * q, m1[k] * q
        u1[k, 0], u1[k, 1], u1[k, 2] = ax - j1 * dx, ay - j1 * dy, az - j1 * dz
        u2[k, 0], u2[k, 1], u2[k, 2] = bx + j2 * dx, by + j2 * dy, bz + j2 * dz


@numba.njit(**OPTIONS)
def polar(m1, m2, v1, theta1, v2, theta2, phi, u1x, u1y, u2x, u2y):
    for k in numba.prange(m1.size):
        c, s = np.cos(phi[k]), np.sin(phi[k])
        ax, ay = v1[k] * np.cos(theta1[k]), v1[k] * np.sin(theta1[k])
        bx, by = v2[k] * np.cos(theta2[k]), v2[k] * np.sin(theta2[k])
        q = 2.0 * ((ax - bx) * c + (ay - by) * s) / (m1[k] + m2[k])
        j1, j2 = m2[k] * q, m1[k] * q
        u1x[k], u1y[k], u2x[k], u2y[k] = ax - j1 * c, ay - j1 * s, bx + j2 * c, by + j2 * s


@numba.njit(**OPTIONS)
def impact(dx, dy, dvx, dvy, distance, t):
    for k in numba.prange(t.size):
        b = dx[k] * dvx[k] + dy[k] * dvy[k]
        square = dvx[k] * dvx[k] + dvy[k] * dvy[k]
        under = b * b - square * (dx[k] * dx[k] + dy[k] * dy[k] - distance[k] * distance[k])
        t[k] = np.inf
        if b < 0.0 and under >= 0.0:
            t[k] = max(0.0, (-b - np.sqrt(under)) / square)


@numba.njit(**OPTIONS)
def impact_3d(dx, dy, dz, dvx, dvy, dvz, distance, t):
    for k in numba.prange(t.size):
        b = dx[k] * dvx[k] + dy[k] * dvy[k] + dz[k] * dvz[k]
        square = dvx[k] * dvx[k] + dvy[k] * dvy[k] + dvz[k] * dvz[k]
        gap = dx[k] * dx[k] + dy[k] * dy[k] + dz[k] * dz[k] - distance[k] * distance[k]
        under = b * b - square * gap
        t[k] = np.inf
        if b < 0.0 and under >= 0.0:
            t[k] = max(0.0, (-b - np.sqrt(under)) / square)


def batch(case: Case) -> Call:
    functions = {"1d": line, "2d": plane, "3d": space, "polar": polar, "impact": impact, "impact_3d": impact_3d}
    return on_threads(functions[case.form], case)


def on_threads(function: Any, case: Case) -> Call:
    def call() -> Sequence[Array]:
        numba.set_num_threads(case.threads)
        function(*case.columns, *case.out)
        return case.out

    return call

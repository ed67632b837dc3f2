"""Numba's parallel loop over the library's own formula, with its guards for numbers of any size."""

from __future__ import annotations

import numba
from cases import Call, Case

import collide

from .missing import MissingError
from .prange import OPTIONS, on_threads


@numba.njit(**OPTIONS)
def line(m1, m2, v1, v2, u1, u2):
    for k in numba.prange(m1.size):
        u1[k], u2[k] = collide.scalar.resolve_1d(m1[k], m2[k], v1[k], v2[k])


@numba.njit(**OPTIONS)
def plane(m1, m2, v1x, v1y, v2x, v2y, nx, ny, u1x, u1y, u2x, u2y):
    for k in numba.prange(m1.size):
        u1x[k], u1y[k], u2x[k], u2y[k] = collide.scalar.resolve_2d(
            m1[k], m2[k], v1x[k], v1y[k], v2x[k], v2y[k], nx[k], ny[k]
        )


@numba.njit(**OPTIONS)
def space(m1, m2, v1x, v1y, v1z, v2x, v2y, v2z, nx, ny, nz, u1x, u1y, u1z, u2x, u2y, u2z):
    for k in numba.prange(m1.size):
        u1x[k], u1y[k], u1z[k], u2x[k], u2y[k], u2z[k] = collide.scalar.resolve_3d(
            m1[k], m2[k], v1x[k], v1y[k], v1z[k], v2x[k], v2y[k], v2z[k], nx[k], ny[k], nz[k]
        )


@numba.njit(**OPTIONS)
def impact(dx, dy, dvx, dvy, distance, t):
    for k in numba.prange(t.size):
        t[k] = collide.scalar.time_of_impact(dx[k], dy[k], dvx[k], dvy[k], distance[k])


@numba.njit(**OPTIONS)
def impact_3d(dx, dy, dz, dvx, dvy, dvz, distance, t):
    for k in numba.prange(t.size):
        t[k] = collide.scalar.time_of_impact_3d(dx[k], dy[k], dz[k], dvx[k], dvy[k], dvz[k], distance[k])


def batch(case: Case) -> Call:
    if case.form == "polar":
        raise MissingError("the library's sine in a scalar loop is no contestant in polar form")
    functions = {"1d": line, "2d": plane, "3d": space, "impact": impact, "impact_3d": impact_3d}
    return on_threads(functions[case.form], case)

"""Taichi. Annotations are evaluated at once here, as Taichi wants them: they are its types."""

import functools
from collections.abc import Callable, Sequence
from typing import Any

from cases import Array, Call, Case

import collide

from .missing import MissingError, collisions_on_all_threads_only, peer


@functools.cache
def _kernels() -> dict[str, Callable[..., Any]]:
    ti = peer("taichi")
    ti.init(arch=ti.cpu, default_fp=ti.f64, cpu_max_num_threads=collide.get_num_threads(), log_level=ti.ERROR)
    column = ti.types.ndarray(dtype=ti.f64, ndim=1)

    @ti.kernel
    def line(m1: column, m2: column, v1: column, v2: column, u1: column, u2: column):
        for k in m1:
            q = 2.0 * (v1[k] - v2[k]) / (m1[k] + m2[k])
            u1[k] = v1[k] - m2[k] * q
            u2[k] = v2[k] + m1[k] * q

    @ti.kernel
    def plane(
        m1: column,
        m2: column,
        v1x: column,
        v1y: column,
        v2x: column,
        v2y: column,
        nx: column,
        ny: column,
        u1x: column,
        u1y: column,
        u2x: column,
        u2y: column,
    ):
        for k in m1:
            closing = (v1x[k] - v2x[k]) * nx[k] + (v1y[k] - v2y[k]) * ny[k]
            q = 2.0 * closing / ((m1[k] + m2[k]) * (nx[k] * nx[k] + ny[k] * ny[k]))
            u1x[k] = v1x[k] - m2[k] * q * nx[k]
            u1y[k] = v1y[k] - m2[k] * q * ny[k]
            u2x[k] = v2x[k] + m1[k] * q * nx[k]
            u2y[k] = v2y[k] + m1[k] * q * ny[k]

    @ti.kernel
    def polar(
        m1: column,
        m2: column,
        v1: column,
        theta1: column,
        v2: column,
        theta2: column,
        phi: column,
        u1x: column,
        u1y: column,
        u2x: column,
        u2y: column,
    ):
        for k in m1:
            c, s = ti.cos(phi[k]), ti.sin(phi[k])
            ax, ay = v1[k] * ti.cos(theta1[k]), v1[k] * ti.sin(theta1[k])
            bx, by = v2[k] * ti.cos(theta2[k]), v2[k] * ti.sin(theta2[k])
            q = 2.0 * ((ax - bx) * c + (ay - by) * s) / (m1[k] + m2[k])
            u1x[k] = ax - m2[k] * q * c
            u1y[k] = ay - m2[k] * q * s
            u2x[k] = bx + m1[k] * q * c
            u2y[k] = by + m1[k] * q * s

    return {"1d": line, "2d": plane, "polar": polar}


def batch(case: Case) -> Call:
    collisions_on_all_threads_only(case)
    if case.form == "3d":
        raise MissingError("measured on a line and in the plane only")
    kernel = _kernels()[case.form]

    def call() -> Sequence[Array]:
        kernel(*case.columns, *case.out)
        return case.out

    return call

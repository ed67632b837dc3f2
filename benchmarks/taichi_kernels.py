"""The formulas as Taichi kernels. A module of its own: Taichi reads the source, and wants its types evaluated."""

import taichi as ti

COLUMN = ti.types.ndarray(dtype=ti.f64, ndim=1)


@ti.kernel
def line(m1: COLUMN, m2: COLUMN, v1: COLUMN, v2: COLUMN, u1: COLUMN, u2: COLUMN):
    for k in m1:
        q = 2.0 * (v1[k] - v2[k]) / (m1[k] + m2[k])
        u1[k] = v1[k] - m2[k] * q
        u2[k] = v2[k] + m1[k] * q


@ti.kernel
def plane(
    m1: COLUMN,
    m2: COLUMN,
    v1x: COLUMN,
    v1y: COLUMN,
    v2x: COLUMN,
    v2y: COLUMN,
    nx: COLUMN,
    ny: COLUMN,
    u1x: COLUMN,
    u1y: COLUMN,
    u2x: COLUMN,
    u2y: COLUMN,
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
    m1: COLUMN,
    m2: COLUMN,
    v1: COLUMN,
    theta1: COLUMN,
    v2: COLUMN,
    theta2: COLUMN,
    phi: COLUMN,
    u1x: COLUMN,
    u1y: COLUMN,
    u2x: COLUMN,
    u2y: COLUMN,
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


KERNELS = {"line": line, "plane": plane, "polar": polar}

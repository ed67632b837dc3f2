"""Loops that a user of Numba would write by hand, on one thread: over pairs in the plane, contacts, balls at walls."""

from __future__ import annotations

from typing import Any

import numba
import numpy as np
from numba import types
from numba.extending import intrinsic

INFINITY: Any = 0x7FF << 52


@intrinsic
def fma(typingctx, x, y, z):
    """x*y + z, rounded once, which Numba has no name for."""
    signature = types.float64(types.float64, types.float64, types.float64)
    return signature, lambda context, builder, sig, args: builder.fma(*args)


@numba.njit(error_model="numpy", forceinline=True)
def power(x, y):
    exponent_x, exponent_y = np.float64(x).view(np.int64) & INFINITY, np.float64(y).view(np.int64) & INFINITY
    return np.int64(INFINITY - max(max(exponent_x, exponent_y), 1 << 52)).view(np.float64)


@numba.njit(error_model="numpy", forceinline=True)
def beyond(x, k):
    bits = np.float64(x).view(np.int64)
    return bits < (1023 - k) << 52 or bits >= (1023 + k) << 52


@numba.njit(error_model="numpy")
def plane(m1, m2, v1x, v1y, v2x, v2y, nx, ny, u1x, u1y, u2x, u2y):
    """The operations of `collide.scalar.resolve_2d`, those for normals and masses far from 1 and for walls included."""
    for k in range(m1.size):
        x, y, first, second = nx[k], ny[k], m1[k], m2[k]
        part = y * y
        square, square_low = fma(x, x, part), fma(y, y, -part)
        if beyond(square, 70):
            scale = power(x, y)
            x, y = scale * x, scale * y
            part = y * y
            square, square_low = fma(x, x, part), fma(y, y, -part)
        if beyond(first + second, 400):
            wall1, wall2 = first == np.inf, second == np.inf
            none1, none2 = 0.0 if first >= 0.0 else first, 0.0 if second >= 0.0 else second
            first = none1 if wall2 else 1.0 if wall1 else first
            second = none2 if wall1 else 1.0 if wall2 else second
            scale = power(first, second)
            first, second = scale * first, scale * second
        dx, dy = v1x[k] - v2x[k], v1y[k] - v2y[k]
        part = dy * y
        closing, low = fma(dx, x, part), fma(dy, y, -part)
        inverse = 1.0 / ((first + second) * square)
        w1, w2 = second * inverse, first * inverse
        j1, j2 = w1 * (2.0 * closing), w2 * (2.0 * closing)
        left = (closing + fma(-j2, square, fma(-j1, square, closing))) + fma(-(j1 + j2), square_low, 2.0 * low)
        j1, j2 = fma(w1, left, j1), fma(w2, left, j2)
        u1x[k], u1y[k], u2x[k], u2y[k] = (
            fma(-j1, x, v1x[k]),
            fma(-j1, y, v1y[k]),
            fma(j2, x, v2x[k]),
            fma(j2, y, v2y[k]),
        )


@numba.njit(error_model="numpy")
def contacts(i, j, x, y, vx, vy):
    """The textbook's formula for equal masses, and no checks."""
    count = 0
    for k in range(i.size):
        a, b = i[k], j[k]
        nx, ny = x[b] - x[a], y[b] - y[a]
        closing = (vx[a] - vx[b]) * nx + (vy[a] - vy[b]) * ny
        if closing > 0.0:
            q = closing / (nx * nx + ny * ny)
            vx[a], vy[a], vx[b], vy[b] = vx[a] - q * nx, vy[a] - q * ny, vx[b] + q * nx, vy[b] + q * ny
            count += 1
    return count


@numba.njit(error_model="numpy")
def walls(x, y, vx, vy, radius, side):
    """For a square, and no checks."""
    count = 0
    for k in range(x.size):
        if (x[k] - radius <= 0.0 and vx[k] < 0.0) or (x[k] + radius >= side and vx[k] > 0.0):
            vx[k] = -vx[k]
            count += 1
        if (y[k] - radius <= 0.0 and vy[k] < 0.0) or (y[k] + radius >= side and vy[k] > 0.0):
            vy[k] = -vy[k]
            count += 1
    return count

"""sin and cos within 1 ulp of the exact value, for every finite argument."""

import math

import mpmath
import numba
import numpy as np
import pytest
from mpmath import mp, mpf

from collide._formulas import sincos as _sincos
from tests.helpers import naive
from tests.helpers.sizes import sizes

ULP = 1.0


@numba.njit
def scalar_sincos(x, s, c):
    for i in range(x.size):
        (s[i], c[i]), _, _ = _sincos.sincos(x[i], 1.0, 1.0)


def sincos(x):
    s, c = np.empty_like(x), np.empty_like(x)
    scalar_sincos(x, s, c)
    return s, c


def arguments(size):
    rng = np.random.default_rng(0)
    k = np.arange(1.0, size // 8)
    multiples = k * (np.pi / 2)
    far = np.round(10.0 ** rng.uniform(5, 9, size // 40)) * (np.pi / 2)
    with mp.workdps(400):
        # The doubles nearest to k*pi/2, exactly rounded, and their neighbours: where the reduction cancels.
        nearest = np.array([float(int(i) * mp.pi / 2) for i in k[::5]])
        huge = np.array([float(mpf(2) ** int(i) * mp.pi / 2) for i in range(0, 1000, 200_000 // size)])
    edges = [
        0.0,
        5e-324,
        2.0**-1022,
        2.0**30,
        2.0**31 * np.pi / 2,
        1e22,
        1e300,
        # of all doubles the one nearest to a multiple of pi/2 (Kahan)
        6381956970095103.0 * 2.0**797,
        1.7976931348623157e308,
    ]
    x = np.concatenate(
        [
            rng.uniform(-4, 4, size * 7 // 20),
            rng.uniform(-100, 100, size // 10),
            2.0 ** rng.uniform(-60, 31, size * 3 // 20),
            2.0 ** rng.uniform(30, 1024, size // 10),
            np.pi / 4 * (1 + rng.uniform(-1e-3, 1e-3, size // 20)),
            multiples,
            far,
            nearest,
            np.nextafter(nearest, 0),
            np.nextafter(nearest, np.inf),
            huge,
            edges,
        ]
    )
    return np.concatenate([x, -x[::10]])


@sizes(usual=20_000, campaign=200_000)
def test_within_one_ulp(size):
    x = arguments(size)
    assert x.size >= size
    worst = [(0.0, 0.0), (0.0, 0.0)]
    for v, s, c in zip(x.tolist(), *(a.tolist() for a in sincos(x)), strict=True):
        with mp.workdps(50 + max(0, int(math.log10(abs(v) + 1)))):
            exact_cos, exact_sin = mpmath.cos_sin(mpf(v))
            worst[0] = max(worst[0], (naive.ulps(s, exact_sin), v))
            worst[1] = max(worst[1], (naive.ulps(c, exact_cos), v))
    print(f"{x.size} arguments; worst ulps and where: sin {worst[0]}, cos {worst[1]}")
    assert worst[0][0] <= ULP
    assert worst[1][0] <= ULP


@pytest.mark.parametrize("x", [np.inf, -np.inf, np.nan])
def test_not_finite_gives_nan(x):
    s, c = sincos(np.array([x, 1.0, x]))
    assert np.isnan(s[[0, 2]]).all()
    assert np.isnan(c[[0, 2]]).all()
    assert s[1] == sincos(np.array([1.0]))[0][0]


def test_plain_python_is_numpy():
    assert _sincos.sincos(0.5, 1.0, 2.0)[0] == (np.sin(0.5), np.cos(0.5))

"""Impulses against the oracle, and against what resolve_2d makes of the velocities."""

import naive
import numba
import numpy as np
import pairs
import pytest
from mpmath import mpf

import collide

INF = np.inf
BOUND = 8  # eps of the largest mass-weighted velocity that takes part


def test_against_50_digits():
    c = pairs.cartesian(3000, seed=11)
    *columns, e = (x[(c[0] != INF) | (c[1] != INF)] for x in c)
    got = collide.impulse_2d(*columns, restitution=e, invalid="nan")
    assert np.isfinite(got).mean() > 0.8
    for p, m1, m2, *rest in zip(got, *columns, e, strict=True):
        if np.isfinite(p):
            exact = naive.impulse_2d(m1, m2, *rest)
            scale = min(m1, m2) * mpf(max(map(abs, rest[:4])))
            assert abs(mpf(float(p)) - exact) <= BOUND * naive.EPS * scale + mpf("1e-320")


def test_it_is_what_resolve_2d_transfers():
    rng = np.random.default_rng(0)
    m1, m2, v1x, v1y, v2x, v2y, nx, ny, e = rng.uniform(0.1, 5, (9, 1003))
    p = collide.impulse_2d(m1, m2, v1x, v1y, v2x, v2y, nx, ny, restitution=e)
    u1x, u1y, u2x, u2y = collide.resolve_2d(m1, m2, v1x, v1y, v2x, v2y, nx, ny, restitution=e)
    length = np.hypot(nx, ny)
    for m, u, v, along in ((m2, u2x, v2x, nx), (m2, u2y, v2y, ny), (-m1, u1x, v1x, nx), (-m1, u1y, v1y, ny)):
        np.testing.assert_allclose(m * (u - v), p * along / length, rtol=1e-12, atol=1e-13)
    approaching = (v1x - v2x) * nx + (v1y - v2y) * ny > 0
    assert (np.sign(p) == np.where(approaching, 1, -1)).all()
    skipped = collide.impulse_2d(m1, m2, v1x, v1y, v2x, v2y, nx, ny, restitution=e, approaching_only=True)
    np.testing.assert_array_equal(skipped, np.where(approaching, p, 0.0))


@pytest.mark.parametrize(
    ("m1", "m2", "want"), [(1.0, INF, 4.0), (INF, 1.0, 4.0), (0.0, 1.0, 0.0), (1.0, 0.0, 0.0), (2.0, 2.0, 4.0)]
)
def test_walls_and_test_particles(m1, m2, want):
    assert collide.impulse_2d(m1, m2, 2.0, 7.0, 0.0, 0.0, 3.0, 0.0) == want
    assert collide.scalar.impulse_2d(m1, m2, 2.0, 7.0, 0.0, 0.0, 3.0, 0.0) == want


def test_the_bits_are_those_of_one_pair_compiled_and_not():
    @numba.njit
    def one_by_one(m1, m2, v1x, v1y, v2x, v2y, nx, ny, e, p):
        for k in range(p.size):
            p[k] = collide.scalar.impulse_2d(m1[k], m2[k], v1x[k], v1y[k], v2x[k], v2y[k], nx[k], ny[k], e[k])

    *columns, e = pairs.cartesian(2003, seed=12)
    batch = collide.impulse_2d(*columns, restitution=e, invalid="nan")
    valid = np.isfinite(batch)
    p = np.empty(2003)
    one_by_one(*columns, e, p)
    np.testing.assert_array_equal(batch[valid], p[valid])
    with np.errstate(all="ignore"):
        np.testing.assert_array_equal(collide.scalar.impulse_2d(*columns, e)[valid], p[valid])


def test_invalid_pairs_and_out():
    m1 = np.array([1.0, -1.0, 1.0, 1e300])
    v1x = np.array([1.0, 1.0, np.nan, 1e300])
    args = (1e300, v1x, 0.0, 0.0, 0.0, 1.0, 0.0)
    out = np.full(4, 9.0)
    with pytest.raises(collide.InvalidPairError, match=r"pair 1: m1 = -1\.0: a mass must be >= 0.*3 invalid pairs"):
        collide.impulse_2d(m1, *args, out=out)
    assert out.tolist() == [2.0, 0.0, 0.0, 0.0]
    assert collide.impulse_2d(m1, *args, invalid="keep").tolist() == [2.0, 0.0, 0.0, 0.0]
    np.testing.assert_array_equal(collide.impulse_2d(m1, *args, invalid="nan"), [2.0, np.nan, np.nan, np.nan])
    with pytest.raises(collide.InvalidPairError, match="the result of the collision, or a step on the way to it"):
        collide.impulse_2d(1e300, 1e300, 1e300, 0.0, 0.0, 0.0, 1.0, 0.0)

"""Impulses against the oracle, and against what resolve_2d makes of the velocities."""

import numba
import numpy as np
import pytest
from mpmath import mpf

import collide
from tests.helpers import naive, pairs

INF = np.inf
# eps of the lighter mass times the largest velocity component before or after. p is rounded by 9 u and a half, where u
# is half an eps, and may be 2.8 times that product, 3.5 times in space; the components of v1-v2 add as much, in u.
# Climbs find less than 6.
BOUND = {"impulse_2d": 16, "impulse_3d": 20}


def error(p, *pair):
    """In eps of the scale; below the smallest normal number float64 has no such thing."""
    impulse, resolve = (naive.impulse_2d, naive.resolve_2d) if len(pair) == 9 else (naive.impulse_3d, naive.resolve_3d)
    exact, after = impulse(*pair), resolve(*pair)
    scale = min(pair[:2]) * max(map(abs, (*map(mpf, pair[2 : 2 + len(after)]), *after)))
    difference = max(mpf(0), abs(mpf(float(p)) - exact) - mpf("1e-320"))
    return float(difference / scale) / naive.EPS if scale else float(difference)


def test_a_climb():
    """In mpmath, as an impulse is one number; 18.8 eps of the velocities before alone were found so."""
    rng = np.random.default_rng(2)
    rows = [list(c) for c in zip(*pairs.plane(2000, seed=13), strict=True) if INF not in c[:2]]
    steep = """
        0.7691485415761121 2499011003888020.0 -0.9449888176821657 -0.900885008040434 0.9464969958293302
        0.921377763959354 0.43002108625724567 0.31054870370577486 1.0"""
    rows.append([float(x) for x in steep.split()])
    rows = [row for row in rows if max(map(abs, row[2:6])) > 1e-140]
    for _ in range(12):
        got = collide.impulse_2d(*np.array(rows).T[:-1], restitution=np.array(rows).T[-1], invalid="nan")
        errors = [error(p, *row) if np.isfinite(p) else 0.0 for p, row in zip(got, rows, strict=True)]
        assert max(errors) <= BOUND["impulse_2d"]
        best = [rows[k] for k in np.argsort(errors)[-20:]]
        rows = [*best, *(np.array(row) * (1 + 2.0 ** rng.uniform(-52, 0) * rng.uniform(-1, 1, 9)) for row in best * 25)]
        rows = [[*np.abs(row[:2]), *row[2:8], min(abs(row[8]), 1.0)] for row in rows]
    print(f"worst found: {max(errors):.2f} eps")
    assert max(errors) > 2.0


@pytest.mark.parametrize(("draw", "function"), [(pairs.plane, collide.impulse_2d), (pairs.space, collide.impulse_3d)])
def test_against_50_digits(draw, function):
    c = draw(3000, seed=11)
    *columns, e = (x[(c[0] != INF) | (c[1] != INF)] for x in c)
    got = function(*columns, restitution=e, invalid="nan")
    assert np.isfinite(got).mean() > 0.8
    for p, m1, m2, *rest in zip(got, *columns, e, strict=True):
        if np.isfinite(p):
            assert error(p, m1, m2, *rest) <= BOUND[function.__name__]


@pytest.mark.fast
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


@pytest.mark.fast
def test_it_is_what_resolve_3d_transfers():
    rng = np.random.default_rng(1)
    m1, m2, e = rng.uniform(0.1, 5, (3, 1003))
    v1, v2, n = rng.normal(size=(3, 3, 1003))
    p = collide.impulse_3d(m1, m2, *v1, *v2, *n, restitution=e)
    u = np.array(collide.resolve_3d(m1, m2, *v1, *v2, *n, restitution=e))
    along = n / np.linalg.norm(n, axis=0)
    np.testing.assert_allclose(m2 * (u[3:] - v2), p * along, rtol=1e-12, atol=1e-13)
    np.testing.assert_allclose(m1 * (v1 - u[:3]), p * along, rtol=1e-12, atol=1e-13)
    np.testing.assert_array_equal(p > 0, ((v1 - v2) * n).sum(0) > 0)


@pytest.mark.fast
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

    @numba.njit
    def one_by_one_in_space(m1, m2, v1x, v1y, v1z, v2x, v2y, v2z, nx, ny, nz, e, p):
        for k in range(p.size):
            p[k] = collide.scalar.impulse_3d(
                m1[k], m2[k], v1x[k], v1y[k], v1z[k], v2x[k], v2y[k], v2z[k], nx[k], ny[k], nz[k], e[k]
            )

    for name, c, loop in (
        ("impulse_2d", pairs.plane(2003, seed=12), one_by_one),
        ("impulse_3d", pairs.space(2003, seed=12), one_by_one_in_space),
    ):
        batch = getattr(collide, name)(*c[:-1], restitution=c[-1], invalid="nan")
        valid = np.isfinite(batch)
        p = np.empty(2003)
        loop(*c, p)
        np.testing.assert_array_equal(batch[valid], p[valid])
        with np.errstate(all="ignore"):
            np.testing.assert_array_equal(getattr(collide.scalar, name)(*c)[valid], p[valid])


@pytest.mark.fast
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

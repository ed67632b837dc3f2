"""The formulas for one pair: in plain Python, and in anyone's compiled code under whatever options."""

import inspect

import numba
import numpy as np
import pytest

import collide
from collide import scalar

PAIR = (1.0, 3.0, 2.0, 0.5, -1.0, 0.25, 1.0, 2.0)
# By hand: the closing speed times |n| is 3.5, n.n is 5, the shares are 3/4 and 1/4.
AFTER = (2 - 1.05, 0.5 - 2.1, -1 + 0.35, 0.25 + 0.7)


@pytest.mark.fast
def test_plain_python():
    np.testing.assert_allclose(scalar.resolve_2d(*PAIR), AFTER, rtol=1e-15)
    assert scalar.resolve_1d(1, 1, 3, 5) == (5, 3)
    got = scalar.resolve_polar(1.0, np.inf, 2.0, np.pi / 2, 0.0, 0.0, np.pi / 2)
    np.testing.assert_allclose(got, (0, -2, 0, 0), atol=1e-15)


@pytest.mark.fast
def test_plain_arrays():
    table = [np.full(5, x) for x in PAIR]
    for u, want in zip(scalar.resolve_2d(*table), AFTER, strict=True):
        np.testing.assert_allclose(u, np.full(5, want), rtol=1e-15)


@pytest.mark.parametrize("options", [{}, {"fastmath": True}, {"error_model": "python"}, {"parallel": True}])
def test_in_a_user_kernel(options):
    @numba.njit(**options)
    def kernel(m1, m2, v1x, v1y, v2x, v2y, nx, ny, out):
        for k in numba.prange(m1.size):
            u = scalar.resolve_2d(m1[k], m2[k], v1x[k], v1y[k], v2x[k], v2y[k], nx[k], ny[k], restitution=0.5)
            out[k, 0], out[k, 1], out[k, 2], out[k, 3] = u

    rng = np.random.default_rng(0)
    c = [rng.uniform(0.1, 5, 1001) for _ in range(8)]
    out = np.empty((1001, 4))
    kernel(*c, out)
    # The same bits as the batch, whatever the caller's options: the formulas keep their own.
    np.testing.assert_array_equal(out.T, collide.resolve_2d(*c, restitution=0.5))


def test_integers_and_float32_in_compiled_code():
    @numba.njit
    def mixed(m, v):
        return scalar.resolve_1d(m, 3, v, 0), scalar.resolve_polar(1, m, v, 0, 0, 0, 0)

    assert mixed(1, 2) == ((-1.0, 1.0), (0.0, 0.0, 2.0, 0.0))
    m, v = np.float32(0.1), np.float32(1 / 3)
    (u1, _), _ = mixed(m, v)
    assert u1 == collide.resolve_1d(float(m), 3.0, float(v), 0.0).u1


def test_integers_do_not_wrap_and_float32_does_not_round_on_the_way():
    @numba.njit
    def call(m1, m2, v1x, v1y, v2x, v2y, nx, ny):
        return scalar.resolve_2d(m1, m2, v1x, v1y, v2x, v2y, nx, ny)

    for function in (call, scalar.resolve_2d):
        np.testing.assert_allclose(function(1, 1, 1, 0, 0, 0, 10**10, 0), (0, 0, 1, 0), atol=1e-15)
        one, two = np.uint64(1), np.uint64(2)
        np.testing.assert_allclose(function(one, one, one, 0, two, 0, np.int8(100), 0), (2, 0, 1, 0), atol=1e-15)
        pair = [np.float32(x) for x in (1, 3, 0.1, 0.7, 0.3, 0.4, 0.6, 0.9)]
        np.testing.assert_array_equal(function(*pair), collide.resolve_2d(*(float(x) for x in pair)))


def test_a_plain_tuple_comes_back():
    @numba.njit
    def sum_of_four(*pair):
        u1x, u1y, u2x, u2y = scalar.resolve_2d(*pair)
        return u1x + u1y + u2x + u2y

    assert sum_of_four(*PAIR) == pytest.approx(sum(AFTER))


@pytest.mark.fast
@pytest.mark.parametrize("name", scalar.__all__)
def test_the_arguments_are_those_of_the_batch_function(name):
    batch = inspect.signature(getattr(collide, name)).parameters
    options = ("approaching_only", "invalid", "out")
    assert list(inspect.signature(getattr(scalar, name)).parameters) == [p for p in batch if p not in options]


def test_float32_restitution_does_not_round_on_the_way():
    e = np.float32(0.1)
    assert scalar.resolve_1d(1.0, 3.0, 0.7, -0.4, e) == scalar.resolve_1d(1.0, 3.0, 0.7, -0.4, float(e))


def test_velocities_on_a_line_do_not_wrap_or_round_either():
    assert scalar.resolve_1d(1, 1, np.uint64(1), np.uint64(2)) == (2.0, 1.0)
    v1, v2 = np.float32(0.1), np.float32(0.7)
    assert scalar.resolve_1d(1, 3, v1, v2) == scalar.resolve_1d(1, 3, float(v1), float(v2))


@pytest.mark.fast
def test_arrays_in_compiled_code_are_refused_by_name():
    @numba.njit
    def call(v, e):
        return scalar.resolve_1d(1.0, 2.0, 3.0, v, restitution=e)

    with pytest.raises(numba.TypingError, match=r"v2 is array\(float64, 1d, C\): .* call collide\.resolve_1d outside"):
        call(np.ones(3), 1.0)
    with pytest.raises(numba.TypingError, match="restitution is UniTuple"):
        call(1.0, (1.0, 0.5))
    assert call(3.0, 1.0) == (3.0, 3.0)

    @numba.njit
    def too_many(v):
        return scalar.resolve_1d(1.0, 2.0, 3.0, v, 1.0, 1.0)

    with pytest.raises(numba.TypingError, match="resolve_1d"):
        too_many(1.0)


@pytest.mark.fast
def test_batch_functions_in_compiled_code_name_the_scalar_ones():
    @numba.njit
    def resolve(v):
        return collide.resolve_1d(1.0, 2.0, v, 0.0, restitution=0.5)

    @numba.njit
    def find(x):
        return collide.find_contacts(x, x, 1.0)

    v = np.ones(3)
    with pytest.raises(
        numba.TypingError, match=r"resolve_1d cannot be called in compiled code: collide\.scalar\.resolve_1d"
    ):
        resolve(v)
    with pytest.raises(
        numba.TypingError,
        match=r"find_contacts cannot be called in compiled code: call it from Python; collide.scalar has",
    ):
        find(v)

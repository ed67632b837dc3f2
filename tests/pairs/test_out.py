"""Results into arrays of the caller's: of any layout, in place, and across the inputs."""

import tracemalloc
from typing import Any

import numpy as np
import pytest
from numpy.lib.stride_tricks import as_strided

import collide
from tests.helpers.textbook import LARGE, RESOLVE, SMALL, check, columns, reference

pytestmark = pytest.mark.fast


@pytest.mark.parametrize("d", RESOLVE)
@pytest.mark.parametrize("n", [1, SMALL, LARGE])
def test_out(n, d):
    c = columns(n, d=d)
    out = tuple(np.empty(n) for _ in range(2 * d))
    got = RESOLVE[d](*c, out=out)
    assert all(u is o for u, o in zip(got, out, strict=True))
    check(out, RESOLVE[d](*c), rtol=0)


def test_out_of_an_earlier_result():
    c = columns(SMALL)
    result = collide.resolve_2d(*c)
    again: Any = collide.resolve_2d(*c, out=result)
    assert all(a is b for a, b in zip(again, result, strict=True))
    check(again, reference(*c))
    row = [x[None, :] for x in c]
    out = tuple(np.empty((1, SMALL)) for _ in range(4))
    check([u[0] for u in collide.resolve_2d(*row, out=out)], reference(*c))


def test_out_of_other_layouts():
    c = columns(LARGE - LARGE % 4)
    want = collide.resolve_2d(*c)
    table = np.empty((c[0].size, 4))
    check(collide.resolve_2d(*c, out=tuple(table.T)), want, rtol=0)
    blocks = [x.reshape(4, -1) for x in c]
    out = tuple(np.empty((4, c[0].size // 4), order="F") for _ in range(4))
    check(collide.resolve_2d(*blocks, out=out), [w.reshape(4, -1) for w in want], rtol=0)
    out = np.empty(()), np.empty(())
    collide.resolve_1d(1, 1, 2, 3, out=out)
    assert (out[0], out[1]) == (3, 2)


@pytest.mark.parametrize("n", [SMALL, LARGE])
@pytest.mark.parametrize(
    "order", [(2, 3, 4, 5), (4, 5, 2, 3), (0, 7, 6, 1), (2, 3, 4, 5, 6, 7), (5, 6, 7, 2, 3, 4), (0, 10, 2, 9, 8, 1)]
)
def test_in_place_in_any_order(n, order):
    d = len(order) // 2
    c = columns(n, d=d)
    want = RESOLVE[d](*c)
    check(RESOLVE[d](*c, out=tuple(c[i] for i in order)), want, rtol=0)


@pytest.mark.parametrize("n", [SMALL, LARGE])
@pytest.mark.parametrize("shift", [-9, -1, 1, 9, 10_000])
def test_any_other_overlap_gives_what_copies_would(n, shift):
    pool = np.random.default_rng(3).uniform(0.1, 5, 2 * n + 2 * abs(shift))
    base = abs(shift)
    view = pool[base : base + n]
    other = [x.copy() for x in columns(n)]
    want = collide.resolve_2d(view.copy(), *other[1:])
    out = (pool[base + shift : base + shift + n], *(np.empty(n) for _ in range(3)))
    check(collide.resolve_2d(view, *other[1:], out=out), want, rtol=0)


@pytest.mark.parametrize("n", [SMALL, LARGE])
def test_overlap_of_other_kinds(n):
    c = columns(n)
    want = collide.resolve_2d(*c)
    table = np.stack(c, axis=1)
    check(collide.resolve_2d(*table.T, out=tuple(table.T[2:6])), want, rtol=0)  # in place in a table
    backwards = c[2].copy()
    got: Any
    got = collide.resolve_2d(c[0], c[1], backwards[::-1], *c[3:], out=(backwards, *(np.empty(n) for _ in range(3))))
    check(got, collide.resolve_2d(c[0], c[1], c[2][::-1], *c[3:]), rtol=0)
    scalar = c[2].copy()  # a size-1 view of an output
    got = collide.resolve_2d(*c[:2], scalar[:1], *c[3:], out=(scalar, *(np.empty(n) for _ in range(3))))
    check(got, collide.resolve_2d(*c[:2], c[2][0], *c[3:]), rtol=0)


def test_large_results_lie_to_the_cache_lines_as_their_inputs_do():
    n = 1 << 20
    for odd in range(0, 64, 8):
        v1 = np.zeros(n + 16)
        v1 = v1[(odd - v1.ctypes.data) % 64 // 8 :][:n]
        for u in collide.resolve_1d(1.0, 1.0, v1, 0.0):
            assert u.ctypes.data % 64 == odd


def test_one_array_twice_is_refused_even_if_empty():
    u = np.empty(0)
    with pytest.raises(ValueError, match=r"out\[0\] and out\[1\] share memory"):
        collide.resolve_1d([], [], [], [], out=(u, u))


def test_outputs_whose_overlap_is_too_hard_to_tell_are_refused():
    memory, shape = np.zeros(1_100_000), (27, 5, 18)
    u1 = as_strided(memory, shape, [8 * k for k in (3552, 14755, 21417)])
    u2 = as_strided(memory[1500:], shape, [8 * k for k in (12841, 1216, 9979)])
    with pytest.raises(np.exceptions.TooHardError):
        np.shares_memory(u1, u2, max_work=10_000)
    with pytest.raises(ValueError, match=r"out\[0\] and out\[1\] share memory"):
        collide.resolve_1d(1.0, 1.0, np.ones(shape), 0.0, out=(u1, u2))
    assert not memory.any()


@pytest.mark.parametrize("side", [6, 120])
def test_an_output_that_is_an_input_transposed(side):
    v1, v2 = np.random.default_rng(5).normal(size=(2, side, side))
    want = collide.resolve_1d(1.0, 3.0, v1, v2)
    memory = v1.copy()
    got = collide.resolve_1d(1.0, 3.0, memory, v2, out=(memory.T, np.empty((side, side))))
    for u, exact in zip(got, want, strict=True):
        np.testing.assert_array_equal(u, exact)


@pytest.mark.parametrize("dtype", ["f8", ">f8"])  # as they lie, and through blocks
def test_strided_outputs_need_no_memory(dtype):
    n = 300_000
    v, table = np.ones(n, dtype), np.empty((n, 2))
    collide.resolve_1d(1.0, 1.0, v, 0.0, out=tuple(table.T))
    tracemalloc.start()
    collide.resolve_1d(1.0, 1.0, v, 0.0, out=tuple(table.T))
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < table.nbytes / 4


@pytest.mark.parametrize("n", [1, 5, 5000, 40_000])
@pytest.mark.parametrize("dtype", ["f8", ">f8"])
def test_an_output_whose_elements_are_one(n, dtype):
    """It holds the last result, as NumPy's do."""
    v, u2 = np.arange(1.0, n + 1).astype(dtype), np.empty(n)
    one = np.lib.stride_tricks.as_strided(np.zeros(1), (n,), (0,))
    collide.resolve_1d(np.ones(n), 1.0, v, 0.0, out=(one, u2))
    assert one[0] == 0.0 and (u2 == v).all()
    collide.resolve_1d(np.ones(n), 1.0, v, 0.0, out=(u2, one))
    assert one[0] == v[-1] and (u2 == 0.0).all()


@pytest.mark.parametrize("out", [([], []), (set(), 1.0), [np.ones(9), np.ones(9)], (np.ones(9),), 3, "ab"])
@pytest.mark.parametrize("invalid", ["raise", "keep"])
def test_what_is_no_array_is_told_by_its_name(out, invalid):
    v = np.ones(9)
    with pytest.raises((TypeError, ValueError), match=r"^out"):
        collide.resolve_1d(v, v, v, v, out=out, invalid=invalid)


def test_arrays_without_dimensions_are_scalars():
    a = np.array(1.0)
    for others in ([a, a, a], [1.0, a, a], [a, a, np.array(1, "f4")], [a, np.float64(1), 1]):
        assert {type(u) for u in collide.resolve_1d(a, *others)} == {np.float64}
    assert type(collide.time_of_impact(*[a] * 5)) is np.float64
    out = np.zeros(()), np.zeros(())
    got = collide.resolve_1d(a, a, np.array(3.0), a, out=out)
    assert got.u1 is out[0] and (out[0], out[1]) == (1.0, 3.0)

"""The facade: dtypes, broadcasting, out, overlap, and errors that name the argument, the value and the rule."""

import tracemalloc

import numpy as np
import pandas as pd
import pytest
from numpy.lib.stride_tricks import as_strided

import collide

SMALL, LARGE = 37, 20_011  # below and above what is copied rather than looked at for overlap; several blocks


def columns(n, seed=0):
    rng = np.random.default_rng(seed)
    return [rng.uniform(0.1, 5, n) for _ in range(2)] + [rng.uniform(-5, 5, n) for _ in range(6)]


def reference(*c, e=1.0):
    """The textbook's vector form in NumPy."""
    m1, m2, v1x, v1y, v2x, v2y, nx, ny = (np.asarray(x, np.float64) for x in c)
    q = (1 + e) * ((v1x - v2x) * nx + (v1y - v2y) * ny) / ((m1 + m2) * (nx * nx + ny * ny))
    return v1x - m2 * q * nx, v1y - m2 * q * ny, v2x + m1 * q * nx, v2y + m1 * q * ny


def check(got, want, dtype=np.float64, rtol=1e-12):
    for u, w in zip(got, want, strict=True):
        assert u.dtype == dtype
        assert u.shape == np.shape(w)
        np.testing.assert_allclose(u, w, rtol=rtol, atol=rtol * 10)


@pytest.mark.parametrize("n", [SMALL, LARGE])
def test_arrays_of_one_shape(n):
    c = columns(n)
    check(collide.resolve_2d(*c), reference(*c))


@pytest.mark.parametrize("n", [SMALL, LARGE])
@pytest.mark.parametrize("scalar", [2, 2.0, True, np.float64(2), np.int8(2), np.array(2.0), np.array([2.0]), [2.0]])
def test_scalars_among_arrays(n, scalar):
    c = columns(n)
    for i in range(8):
        mixed = [*c[:i], scalar, *c[i + 1 :]]
        check(collide.resolve_2d(*mixed), reference(*(np.broadcast_to(x, n) for x in mixed)))


@pytest.mark.parametrize("shapes", [((3, 1), (1, 4)), ((2, 3, 4), (4,)), ((5, 1, 1), (2, 1), (3,)), ((1, 1), (7,))])
def test_broadcasting(shapes):
    rng = np.random.default_rng(1)
    c = [rng.uniform(0.1, 5, shapes[i % len(shapes)]) for i in range(8)]
    check(collide.resolve_2d(*c), reference(*c))


def test_broadcasting_of_large_arrays():
    rng = np.random.default_rng(1)
    c = [rng.uniform(0.1, 5, shape) for shape in ((170, 1), (1, 190), (170, 190)) * 2] + [0.5, 2.0]
    check(collide.resolve_2d(*c), reference(*c))


@pytest.mark.parametrize("n", [SMALL, LARGE])
def test_strides_orders_and_byte_orders(n):
    c = columns(n)
    table = np.stack(c, axis=1)
    want = reference(*c)
    check(collide.resolve_2d(*table.T), want)  # the columns of an (N, 8) array
    check(collide.resolve_2d(*(x[::-1] for x in c)), [w[::-1] for w in want])
    check(collide.resolve_2d(*(x.astype(">f8") for x in c)), want)
    check(collide.resolve_2d(c[0], np.broadcast_to(2.0, n), *c[2:]), reference(c[0], 2.0, *c[2:]))
    odd = [np.frombuffer(b"\0" + x.tobytes(), np.uint8)[1:].view(np.float64) for x in c]  # misaligned, read-only
    assert not odd[0].flags.aligned
    check(collide.resolve_2d(*odd), want)
    square = [np.asfortranarray(x[: n // 6 * 6].reshape(6, -1)) for x in c]
    check(collide.resolve_2d(*square), reference(*square))
    check(collide.resolve_2d(*(x.T[::2, ::-1] for x in square)), reference(*(x.T[::2, ::-1] for x in square)))


@pytest.mark.parametrize("n", [SMALL, LARGE])
@pytest.mark.parametrize("dtype", ["?", "b", "u1", "i2", "u4", "i8", "u8", "f2", "f4"])
def test_dtypes(n, dtype):
    c = columns(n)
    c[0] = np.ones(n, dtype) if dtype == "?" else (1 + np.arange(n) % 90).astype(dtype)
    check(collide.resolve_2d(*c), reference(*c))
    singles = [c[0], *(x.astype(np.float32) for x in c[1:])]
    result = np.float32 if np.result_type(np.dtype(dtype), np.float32) == np.float32 else np.float64
    check(collide.resolve_2d(*singles), reference(*singles), result, rtol=1e-5 if result == np.float32 else 1e-12)


def test_the_dtype_of_the_result():
    f4, f2 = np.ones(3, np.float32), np.ones(3, np.float16)
    for m1, v1, dtype in [
        (1.0, f4, "f4"),
        (1, f4, "f4"),
        (f2, f2, "f4"),
        (np.float64(1), f4, "f8"),
        (np.float32(1), f4, "f4"),
        (1.0, [1.0], "f8"),
        (1, 1, "f8"),
        (np.ones(3, int), f4, "f8"),
        (np.ones(3, np.int16), f4, "f4"),
    ]:
        assert collide.resolve_1d(m1, 1, v1, 0)[0].dtype == dtype
    assert collide.resolve_1d(f4, 1, f4, 0, restitution=np.float64(1))[0].dtype == np.float64


def test_python_scalars_keep_their_precision_beside_float32():
    v = np.linspace(1, 2, 50, dtype=np.float32)
    u1, _ = collide.resolve_1d(0.1, 0.3, v, -v)
    np.testing.assert_array_equal(u1, collide.resolve_1d(0.1, 0.3, v.astype(float), -v.astype(float))[0].astype("f4"))


def test_scalars_in_scalars_out():
    u = collide.resolve_2d(1, 3.0, 1, 0, 0, 0, np.float64(1), 1)
    assert tuple(u) == (0.25, -0.75, 0.25, 0.25)
    assert all(type(x) is np.float64 for x in u)
    assert all(type(x) is np.float32 for x in collide.resolve_1d(*np.ones(4, np.float32)))
    assert u._fields == ("u1x", "u1y", "u2x", "u2y")
    assert collide.resolve_1d(np.array(1.0), 1, 2, 0) == (0.0, 2.0)
    assert collide.resolve_1d([1.0], 1, 2, 0).u2.shape == (1,)


@pytest.mark.parametrize("ndim", [32, 33, 64])
def test_as_many_dimensions_as_an_array_may_have(ndim):
    a, b, v = np.full((2,) + (1,) * (ndim - 2) + (1,), 3.0), np.full((1,) * (ndim - 1) + (3,), 1.0), np.array([2.0])
    u1, u2 = collide.resolve_1d(a, b, np.ones((2,) + (1,) * (ndim - 3) + (5, 1)), v)
    assert u1.shape == u2.shape == (2,) + (1,) * (ndim - 3) + (5, 3)
    np.testing.assert_array_equal(u1, 1.5)
    np.testing.assert_array_equal(u2, 0.5)
    with pytest.raises(ValueError, match=r"do not broadcast together: m1 \(2, 1,"):
        collide.resolve_1d(a, b, np.ones(4), 0.0)


def test_more_elements_than_memory_has_addresses():
    """Of NumPy's it would be an error that names no argument."""
    large = np.broadcast_to(np.int8(1), (1 << 31, 1, 1))
    for m1 in (large, large[:0]):
        with pytest.raises(ValueError, match=r"^the shapes of the arguments broadcast to \(.* elements: m1 \(.*, v1 "):
            collide.resolve_1d(m1, np.ones((1, 1, 1)), large.swapaxes(0, 1), large.swapaxes(0, 2))
    with pytest.raises(ValueError, match=r"elements: v1 \(2305843009213693952,\)"):
        collide.resolve_1d(1.0, 1.0, np.broadcast_to(np.int8(1), (1 << 61,)), 0.0)


@pytest.mark.parametrize("name", ["resolve_1d", "resolve_2d", "resolve_polar", "impulse_2d"])
def test_two_immovable_balls_that_do_not_approach_are_left_alone(name):
    """As the docstrings say, on a line too."""
    function = getattr(collide, name)
    between = {"resolve_1d": (0.0,), "resolve_polar": (0.0, 1.0, 0.0, 0.0)}.get(name, (0.0, 1.0, 0.0, 1.0, 0.0))
    u = function([np.inf], [np.inf], [-1.0], *between, approaching_only=True)
    assert (u[0] if name.startswith("resolve") else u - 1.0) == [-1.0]
    for approaching_only, v in ((True, 2.0), (False, -1.0)):
        with pytest.raises(collide.InvalidPairError, match="m1 = m2 = inf"):
            function([np.inf], [np.inf], [v], *between, approaching_only=approaching_only)
    assert "two immovable balls among" in function.__doc__


def test_empty():
    for shape in ((0,), (3, 0)):
        u = collide.resolve_2d(np.empty(shape), 1, 1, 1, np.empty(shape), 1, 1, 1)
        assert [x.shape for x in u] == [shape] * 4
    assert collide.resolve_1d([], [], [], []).u1.shape == (0,)


def test_lists_and_series():
    c = columns(SMALL)
    check(collide.resolve_2d(*(x.tolist() for x in c)), reference(*c))
    check(collide.resolve_2d(*(pd.Series(x, index=np.arange(SMALL)[::-1]) for x in c)), reference(*c))
    table = pd.DataFrame(np.stack(c, axis=1))
    check(collide.resolve_2d(*(table[i] for i in table)), reference(*c))


@pytest.mark.parametrize("n", [SMALL, LARGE])
@pytest.mark.parametrize("e", [0.0, 0.5, 2.0, "array"])
def test_restitution(n, e):
    c = columns(n)
    e = np.random.default_rng(2).random(n) if e == "array" else e
    check(collide.resolve_2d(*c, restitution=e), reference(*c, e=e))


def test_inputs_are_not_touched():
    for n in (SMALL, LARGE):
        c = columns(n)
        copies = [x.copy() for x in c]
        for x in c:
            x.flags.writeable = False
        collide.resolve_2d(*c)
        for x, y in zip(c, copies, strict=True):
            np.testing.assert_array_equal(x, y)


@pytest.mark.parametrize("n", [1, SMALL, LARGE])
def test_out(n):
    c = columns(n)
    out = tuple(np.empty(n) for _ in range(4))
    got = collide.resolve_2d(*c, out=out)
    assert all(u is o for u, o in zip(got, out, strict=True))
    check(out, collide.resolve_2d(*c), rtol=0)


def test_out_of_an_earlier_result():
    c = columns(SMALL)
    result = collide.resolve_2d(*c)
    again = collide.resolve_2d(*c, out=result)
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
@pytest.mark.parametrize("order", [(2, 3, 4, 5), (4, 5, 2, 3), (0, 7, 6, 1)])
def test_in_place_in_any_order(n, order):
    c = columns(n)
    want = collide.resolve_2d(*c)
    check(collide.resolve_2d(*c, out=tuple(c[i] for i in order)), want, rtol=0)


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
    got = collide.resolve_2d(c[0], c[1], backwards[::-1], *c[3:], out=(backwards, *(np.empty(n) for _ in range(3))))
    check(got, collide.resolve_2d(c[0], c[1], c[2][::-1], *c[3:]), rtol=0)
    scalar = c[2].copy()  # a size-1 view of an output
    got = collide.resolve_2d(*c[:2], scalar[:1], *c[3:], out=(scalar, *(np.empty(n) for _ in range(3))))
    check(got, collide.resolve_2d(*c[:2], c[2][0], *c[3:]), rtol=0)


ONE = np.ones(3)
WRONG = [
    (dict(m1=None), TypeError, "m1: the dtype object"),
    (dict(v1="3"), TypeError, "v1: the dtype <U1"),
    (dict(v2=[b"x"]), TypeError, "v2: the dtype |S1"),
    (dict(m1=1j), TypeError, "m1: the dtype complex128"),
    (dict(m2=np.ones(3, object)), TypeError, "m2: the dtype object"),
    (dict(m2=np.ones(3, np.longdouble)), TypeError, "m2: the dtype"),
    (dict(m2=np.array(["2020"], "M8[Y]")), TypeError, "m2: the dtype datetime64"),
    (dict(v1=np.ma.masked_array(ONE, [0, 1, 0])), TypeError, "v1: masked arrays"),
    (dict(v1=[[1, 2], [3]]), TypeError, "v1 = "),
    (dict(v1=[np.ma.masked_array([1.0, 2.0], [0, 1])]), TypeError, "v1: masked arrays"),
    (dict(v1=(np.ma.masked_array([1.0, 2.0], [0, 1]),)), TypeError, "v1: masked arrays"),
    (dict(v1=10**400), TypeError, "v1: an integer of 1329 bits is too large"),
    (dict(restitution="x"), TypeError, "restitution: the dtype"),
    (dict(v1=np.ones(4)), ValueError, r"do not broadcast together: m1 (3,), m2 (3,), v1 (4,)"),
    (dict(invalid="ignore"), ValueError, "invalid = 'ignore': must be one of 'raise', 'keep', 'nan'"),
    (dict(invalid=None), ValueError, "invalid = None"),
    (dict(approaching_only="yes"), TypeError, "approaching_only = 'yes'"),
    (dict(out=ONE), TypeError, "out = ndarray: must be None or a tuple of 2 arrays"),
    (dict(out=[ONE, ONE]), TypeError, "out = list"),
    (dict(out=(np.empty(3),)), ValueError, "out has 1 arrays: must have 2, for u1, u2"),
    (dict(out=(np.empty(3), None)), TypeError, "out[1] is of type NoneType"),
    (dict(out=(np.empty(3), np.empty(3, np.float32))), TypeError, "out[1] has dtype float32"),
    (dict(out=(np.empty(4), np.empty(3))), ValueError, "out[0] has shape (4,): must have the broadcast shape, (3,)"),
    (dict(out=(np.empty(3), np.broadcast_to(1.0, 3))), ValueError, "out[1] is read-only"),
    (dict(out=(ONE, ONE)), ValueError, "out[0] and out[1] share memory"),
]


@pytest.mark.parametrize(("change", "error", "message"), WRONG)
def test_errors(change, error, message):
    arguments = {"m1": ONE, "m2": ONE, "v1": 2 * ONE, "v2": 0 * ONE, **change}
    with pytest.raises(error) as info:
        collide.resolve_1d(**arguments)
    assert message in str(info.value)
    np.testing.assert_array_equal(ONE, 1)


@pytest.mark.parametrize("name", ["resolve_1d", "resolve_2d", "resolve_polar"])
def test_missing_and_surplus_arguments(name):
    with pytest.raises(TypeError, match="missing"):
        getattr(collide, name)(1.0)
    with pytest.raises(TypeError, match="positional"):
        getattr(collide, name)(*[1.0] * 10)


def test_a_message_stays_short_whatever_the_value():
    with pytest.raises(TypeError) as info:
        collide.resolve_1d([[1, 2], [3]] * 100_000, 1, 1, 1)
    assert len(str(info.value)) < 400


@pytest.mark.parametrize("n", [3, LARGE])
def test_byte_order_is_not_taken_for_native(n):
    """Numba's look at an array leaves the byte order out, once it has seen a native one with the same flags."""
    v = np.arange(1.0, n + 1)
    for writeable in (True, False):
        native, swapped = v.copy(), v.astype(">f8")
        native.flags.writeable = swapped.flags.writeable = writeable
        for _ in range(3):
            np.testing.assert_array_equal(collide.resolve_1d(1.0, 1.0, native, 0.0).u2, v)
            np.testing.assert_array_equal(collide.resolve_1d(1.0, 1.0, swapped, 0.0).u2, v)


@pytest.mark.parametrize("n", [3, LARGE])
def test_a_signalling_nan_warns_nobody(n):
    v = np.ones(n, np.float32)
    v.view(np.uint32)[1] = 0x7F800001
    with np.errstate(all="raise"):
        u = collide.resolve_1d(1.0, 1.0, v, np.zeros(n), invalid="nan").u2
    assert np.isnan(u[1])
    assert u[2] == 1


def test_integers_of_any_size_are_floats():
    for shape in ((3,), (1, 3), (5000,)):
        np.testing.assert_array_equal(collide.resolve_1d(2**70, 1, np.ones(shape), 0).u1, np.full(shape, 1.0))


@pytest.mark.parametrize("shape", [(2, 20_000), (20_000, 2), (30, 40, 50), (1, 9000, 3), (9001,)])
def test_blocks_of_every_shape(shape):
    rng = np.random.default_rng(4)
    c = [np.asfortranarray(rng.uniform(0.1, 5, shape)) for _ in range(7)] + [rng.uniform(0.1, 5, shape[-1:])]
    check(collide.resolve_2d(*c), reference(*c))
    out = tuple(np.empty(shape[::-1]).T for _ in range(4))
    check(collide.resolve_2d(*c, out=out), reference(*c))
    c[0][tuple(n - 1 for n in shape)] = c[0][tuple(n // 2 for n in shape)] = -1
    with pytest.raises(collide.InvalidPairError) as info:
        collide.resolve_2d(*c)
    assert info.value.index == tuple(n // 2 for n in shape)
    assert info.value.count == 2


def test_shapes_of_one_size():
    with pytest.raises(ValueError, match=r"do not broadcast together: m1 \(2, 3\), m2 \(3, 2\)"):
        collide.resolve_1d(np.ones((2, 3)), np.ones((3, 2)), 1.0, 0.0)
    v1, v2 = np.arange(3.0), np.arange(3.0)[:, None]
    u1, u2 = collide.resolve_1d(1.0, 1.0, v1, v2)
    np.testing.assert_array_equal(u1, np.broadcast_to(v2, (3, 3)))
    np.testing.assert_array_equal(u2, np.broadcast_to(v1, (3, 3)))


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


@pytest.mark.usefixtures("keep_threads")
def test_shares_that_begin_within_a_row():
    collide.set_num_threads(3)
    v = np.random.default_rng(6).normal(size=(40_000, 5))
    u1, u2 = collide.resolve_1d(1.0, 1.0, np.asfortranarray(v), 0.0)
    np.testing.assert_array_equal(u2, v)
    np.testing.assert_array_equal(u1, 0.0)


def test_strided_outputs_are_written_through_blocks():
    n = 300_000
    v, table = np.ones(n), np.empty((n, 2))
    collide.resolve_1d(1.0, 1.0, v, 0.0, out=tuple(table.T))
    tracemalloc.start()
    collide.resolve_1d(1.0, 1.0, v, 0.0, out=tuple(table.T))
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < table.nbytes / 4

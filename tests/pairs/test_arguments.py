"""The facade: dtypes, broadcasting, shapes, and errors that name the argument, the value and the rule."""

import numpy as np
import pandas as pd
import pytest

import collide
from tests.helpers.textbook import LARGE, RESOLVE, SMALL, check, columns, reference


@pytest.mark.parametrize("d", RESOLVE)
@pytest.mark.parametrize("n", [SMALL, LARGE])
def test_arrays_of_one_shape(n, d):
    c = columns(n, d=d)
    check(RESOLVE[d](*c), reference(*c))


@pytest.mark.parametrize("n", [SMALL, LARGE])
@pytest.mark.parametrize("scalar", [2, 2.0, True, np.float64(2), np.int8(2), np.array(2.0), np.array([2.0]), [2.0]])
def test_scalars_among_arrays(n, scalar):
    c = columns(n)
    for i in range(8):
        mixed = [*c[:i], scalar, *c[i + 1 :]]
        check(collide.resolve_2d(*mixed), reference(*(np.broadcast_to(x, n) for x in mixed)))


@pytest.mark.parametrize("d", RESOLVE)
@pytest.mark.parametrize("shapes", [((3, 1), (1, 4)), ((2, 3, 4), (4,)), ((5, 1, 1), (2, 1), (3,)), ((1, 1), (7,))])
def test_broadcasting(shapes, d):
    rng = np.random.default_rng(1)
    c = [rng.uniform(0.1, 5, shapes[i % len(shapes)]) for i in range(2 + 3 * d)]
    check(RESOLVE[d](*c), reference(*c))


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


@pytest.mark.parametrize("d", RESOLVE)
@pytest.mark.parametrize("n", [SMALL, LARGE])
@pytest.mark.parametrize("e", [0.0, 0.5, 2.0, "array"])
def test_restitution(n, e, d):
    c = columns(n, d=d)
    e = np.random.default_rng(2).random(n) if e == "array" else e
    check(RESOLVE[d](*c, restitution=e), reference(*c, e=e))


def test_inputs_are_not_touched():
    for n in (SMALL, LARGE):
        c = columns(n)
        copies = [x.copy() for x in c]
        for x in c:
            x.flags.writeable = False
        collide.resolve_2d(*c)
        for x, y in zip(c, copies, strict=True):
            np.testing.assert_array_equal(x, y)


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


@pytest.mark.parametrize("name", ["resolve_1d", "resolve_2d", "resolve_3d", "resolve_polar"])
def test_missing_and_surplus_arguments(name):
    with pytest.raises(TypeError, match="missing"):
        getattr(collide, name)(1.0)
    with pytest.raises(TypeError, match="positional"):
        getattr(collide, name)(*[1.0] * 12)


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


@pytest.mark.usefixtures("keep_threads")
def test_shares_that_begin_within_a_row():
    collide.set_num_threads(3)
    v = np.random.default_rng(6).normal(size=(40_000, 5))
    u1, u2 = collide.resolve_1d(1.0, 1.0, np.asfortranarray(v), 0.0)
    np.testing.assert_array_equal(u2, v)
    np.testing.assert_array_equal(u1, 0.0)

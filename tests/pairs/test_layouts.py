"""Columns however they lie: rows, records and any other step have the bits of columns without gaps; and `resolve`."""

from typing import Any

import numpy as np
import pytest

import collide
from collide._pairs.forms import FORMS
from collide._pairs.loop import REFUSED
from tests.helpers import pairs, process

FUNCTIONS: dict[str, Any] = {
    "1d": collide.resolve_1d,
    "2d": collide.resolve_2d,
    "3d": collide.resolve_3d,
    "polar": collide.resolve_polar,
    "impulse_2d": collide.impulse_2d,
    "impulse_3d": collide.impulse_3d,
    "impact": collide.time_of_impact,
    "impact_3d": collide.time_of_impact_3d,
}
SIZES = [*range(1, 36), 260, 70_000]  # every tail of a step, in both storages; the last for several threads


def columns_of(form, n, dtype, seed=0):
    c: Any
    rng = np.random.default_rng(seed)
    impact = form.startswith("impact")
    if impact:
        c = [*rng.normal(size=(6 if form == "impact_3d" else 4, n)), rng.random(n)]
    elif form == "polar":
        c = pairs.polar(n, seed)
    elif form.endswith("3d"):
        c = pairs.space(n, seed)
    else:
        c = pairs.plane(n, seed)
        c = (*c[:4], c[-1]) if form == "1d" else c
    if dtype == "f4":  # within its range, whatever the pair
        c = [np.clip(np.nan_to_num(x, posinf=1e9), -1e9, 1e9).astype("f4") for x in c]
        positive = -1 if impact else 0
        c[positive] = np.abs(c[positive]) + np.float32(0.5)
        if form[-2:] in ("2d", "3d") and not impact:
            c[-2] = c[-2] + np.float32(1e-6) * (c[-2] == 0)
    return [np.ascontiguousarray(x) for x in c]


def call(form, c, out=None):
    options = {"out": out if out is None or len(out) > 1 else out[0], "invalid": "nan"}
    if form.startswith("impact"):
        u = FUNCTIONS[form](*c, **options)
    else:
        u = FUNCTIONS[form](*c[:-1], restitution=c[-1], **options)
    return list(u) if isinstance(u, tuple) else [u]


def assert_same_bits(got, want):
    for a, b in zip(got, want, strict=True):
        assert a.dtype == b.dtype
        np.testing.assert_array_equal(a.view(f"i{a.itemsize}"), b.view(f"i{b.itemsize}"))


def stepped(a, step):
    """The same numbers, so many bytes from one to the next."""
    extent = abs(step) * max(a.size - 1, 0) + a.itemsize
    memory = np.full(extent, 0x3F, np.uint8)  # numbers between them that no check finds odd, as it would NaN
    start = extent - a.itemsize if step < 0 else 0
    view = np.ndarray(a.shape, a.dtype, memory, start, (step,))
    view[...] = a
    return view


@pytest.mark.parametrize("dtype", ["f8", "f4"])
@pytest.mark.parametrize("form", FUNCTIONS)
def test_every_step_and_every_tail(form, dtype):
    item = np.dtype(dtype).itemsize
    steps = [2 * item, 3 * item, 4 * item, 8 * item, 9 * item, 20 * item, -item, -2 * item, item + 3, 2 * item + 1]
    for n in SIZES:
        c = columns_of(form, n, dtype)
        want = call(form, c)
        for k, step in enumerate(steps):
            if n > 300 and k % 3:
                continue
            assert_same_bits(call(form, [stepped(x, step) for x in c]), want)
            out = tuple(stepped(np.zeros_like(u), step) for u in want)
            assert_same_bits(call(form, c, out), want)
        for i in range(len(c)):  # each column alone among columns without gaps
            assert_same_bits(call(form, [stepped(x, 2 * item) if i == k else x for k, x in enumerate(c)]), want)


@pytest.mark.parametrize(("form", "d"), [*(("2d", d) for d in (2, 3, 4, 5, 8)), *(("3d", d) for d in (3, 4, 8))])
@pytest.mark.parametrize("dtype", ["f8", "f4"])
@pytest.mark.parametrize("n", [1, 7, 8, 9, 16, 23, 1000, 70_001, 300_001])  # the last is streamed
def test_rows(n, dtype, form, d):
    c = columns_of(form, n, dtype)
    want = call(form, c)
    k = len(want) // 2  # components

    def rows(*columns):
        a = np.full((n, d), 7.0, dtype)
        for k, column in enumerate(columns):
            a[:, k] = column
        return a

    v1, v2, normals = (rows(*c[first : first + k]) for first in range(2, 2 + 3 * k, k))
    u1, u2 = rows(), rows()
    given = [*c[:2], *v1.T[:k], *v2.T[:k], *normals.T[:k], c[-1]]
    got = call(form, given, (*u1.T[:k], *u2.T[:k]))
    assert_same_bits([np.ascontiguousarray(u) for u in got], want)
    assert (u1[:, k:] == 7.0).all() and (u2[:, k:] == 7.0).all()

    got = call(form, given, (*v1.T[:k], *v2.T[:k]))  # in place
    assert_same_bits([np.ascontiguousarray(u) for u in got], want)
    assert (v1[:, k:] == 7.0).all() and (v2[:, k:] == 7.0).all()


@pytest.mark.parametrize("order", [(0, 1, 2, 3), (1, 0, 3, 2), (0, 2, 1, 3), (3, 1, 0, 2)])
@pytest.mark.parametrize("n", [5, 3000, 300_001])
def test_results_in_one_array(order, n):
    c = columns_of("2d", n, "f8")
    u = np.zeros((n, 4))
    call("2d", c, tuple(u[:, k] for k in order))
    assert_same_bits([np.ascontiguousarray(u[:, k]) for k in order], call("2d", c))


# A letter is an array of rows, a number one of its columns; a dash is a column by itself.
AMONG_OTHERS = ["a0 a2 a1 b0 b1 b2", "a0 a1 a2 b1 b2 -", "- - c0 c1 - -", "- a0 a1 a2 - -", "a0 a1 a2 - c0 c1"]


@pytest.mark.parametrize("lie", AMONG_OTHERS)
@pytest.mark.parametrize("n", [9, 1000, 300_001])
def test_rows_of_three_among_others(lie, n):
    c = columns_of("3d", n, "f8")

    def columns():
        rows = {"a": np.zeros((n, 3)), "b": np.zeros((n, 3)), "c": np.zeros((n, 2))}
        return tuple(np.zeros(n) if part == "-" else rows[part[0]][:, int(part[1])] for part in lie.split())

    given, out = columns(), columns()
    for column, x in zip(given, c[2:8], strict=True):
        column[...] = x
    got = call("3d", [*c[:2], *given, *c[8:]], out)
    assert_same_bits([np.ascontiguousarray(u) for u in got], call("3d", c))


@pytest.mark.parametrize("n", [3, 1000, 70_000])
def test_records(n):
    c = columns_of("2d", n, "f8")
    ball = np.dtype([("id", "i2"), ("m", "f8"), ("v", "f8", 2), ("name", "S3")])  # packed: odd steps and places
    balls = np.zeros((2, n), ball)
    balls["m"], balls["v"][0].T[:], balls["v"][1].T[:] = c[:2], c[2:4], c[4:6]
    balls["name"] = b"abc"
    state = [*balls["m"], *balls["v"][0].T, *balls["v"][1].T]
    want = call("2d", c)
    got = call("2d", [*state, *c[6:]], tuple(state[2:]))
    assert_same_bits([np.ascontiguousarray(u) for u in got], want)
    assert (balls["name"] == b"abc").all() and (balls["id"] == 0).all()


@pytest.mark.parametrize("n", [40, 5000, 70_000])
def test_shifted_rows_are_as_copies(n):
    """Outputs that overlap inputs otherwise than in place."""
    c = columns_of("2d", n + 1, "f8")
    part = [x[:n] for x in c]
    want = call("2d", part)
    for shift in (0, 1):
        rows = np.empty((n + 1, 2))
        rows[:n, 0], rows[:n, 1] = part[2], part[3]
        given = [*part[:2], rows[:n, 0], rows[:n, 1], *part[4:]]
        out = rows[shift : n + shift, 0], rows[shift : n + shift, 1], np.empty(n), np.empty(n)
        assert_same_bits([np.ascontiguousarray(u) for u in call("2d", given, out)], want)
    memory = np.empty(2 * n)
    memory[:n] = part[2]
    given = [*part[:2], memory[:n], *part[3:]]
    got = call("2d", given, (memory[::2], np.empty(n), np.empty(n), np.empty(n)))  # of another step
    assert_same_bits([np.ascontiguousarray(u) for u in got], want)


@pytest.mark.parametrize("n", [1, 9, 5000, 70_000])
def test_a_float64_number_beside_float32_arrays(n):
    c = columns_of("2d", n, "f4")
    wide = [x.astype("f8") for x in c[:-1]]
    e = np.float64(0.9)  # makes the result float64, which a Python float does not
    got = collide.resolve_2d(*c[:-1], restitution=e)
    assert_same_bits(got, collide.resolve_2d(*wide, restitution=e))
    assert_same_bits(collide.resolve_2d(np.float64(0.1), *c[1:-1]), collide.resolve_2d(np.float64(0.1), *wide[1:]))
    assert collide.resolve_2d(*c[:-1], restitution=0.9).u1x.dtype == np.float32


def test_kernels_know_byte_swapped_arrays():
    """Numba takes read-only ones for native ones: kernels must tell."""
    n = 20
    for name, form in FORMS.items():
        for storage, kernel in form.kernels.items():
            columns = [np.ones(n, storage[0]) for _ in form.columns]
            outputs = [np.zeros(n, storage[1]) for _ in form.outputs]
            rest = np.empty(len(columns) + 1), 0, n, 0, False, False
            assert kernel.compiled(*columns, *outputs, *rest) >= 0, (name, storage)
            for k in range(len(columns)):
                given = list(columns)
                given[k] = columns[k].astype(columns[k].dtype.newbyteorder())
                given[k].flags.writeable = False
                for u in outputs:
                    u.fill(7.0)
                assert kernel.compiled(*given, *outputs, *rest) == REFUSED, (name, storage, k)
                assert all((u == 7.0).all() for u in outputs)


@pytest.mark.parametrize("order", [(0, 1, 2, 3), (3, 2, 1, 0), (1, 3, 0, 2), (2, 0, 3, 1)])
def test_what_numba_has_seen_does_not_matter(order):
    """It knows arrays that are not as usual by a part of what they are: of two kinds the first counts for both."""
    code = """
import sys
import numpy as np, collide

def misaligned(a):
    b = np.empty(a.nbytes + 1, np.uint8)[1:].view(a.dtype)
    b[...] = a
    return b

def read_only(a):
    a = a.copy()
    a.flags.writeable = False
    return a

def swapped(a):
    return a.astype(">f8")

kinds = [misaligned, swapped, lambda a: read_only(misaligned(a)), lambda a: read_only(swapped(a))]
v = np.random.default_rng(0).random(9000)
for n in (20, 9000):
    want = collide.resolve_1d(v[:n], 1.0, v[:n], 0.0)
    for k in map(int, sys.argv[1:]):
        for which in (0, 2):
            c = [v[:n], 1.0, v[:n], 0.0]
            c[which] = kinds[k](c[which])
            got = collide.resolve_1d(*c, out=(misaligned(v[:n]), np.empty(n)))
            assert all((a == b).all() for a, b in zip(got, want)), (n, k, which)
"""
    assert process.printed_by(code, *order) == ""


def test_an_empty_column_is_no_number():
    c = columns_of("2d", 9, "f8")
    for k in range(8):
        given = list(c[:-1])
        given[k] = np.empty(0)
        with pytest.raises(ValueError, match=r"^the shapes of the arguments do not broadcast together"):
            collide.resolve_2d(*given)


# `resolve`


def vectors(n, dtype, d):
    m1, m2, *v, e = columns_of(f"{d}d", n, dtype)
    return m1, m2, *(np.stack(v[k : k + d], axis=-1) for k in (0, d, 2 * d)), e


@pytest.mark.parametrize("dtype", ["f8", "f4"])
@pytest.mark.parametrize("d", [2, 3])
@pytest.mark.parametrize("n", [1, 8, 100, 70_000, 300_000])
def test_vectors_have_the_bits_of_columns(n, d, dtype):
    *given, e = vectors(n, dtype, d)
    want = call(f"{d}d", columns_of(f"{d}d", n, dtype))
    for got in (
        collide.resolve(*given, restitution=e, invalid="nan"),
        collide.resolve(*given, restitution=e, invalid="nan", out=(np.empty((n, d), dtype), np.empty((n, d), dtype))),
        collide.resolve(*map(np.asfortranarray, given), restitution=e, invalid="nan"),
    ):
        assert_same_bits([np.ascontiguousarray(u.T[k]) for u in got for k in range(d)], want)
    got = collide.resolve(*given, restitution=e, invalid="nan", out=(given[2], given[3]))
    assert got.u1 is given[2] and got.u2 is given[3]
    assert_same_bits([np.ascontiguousarray(u.T[k]) for u in got for k in range(d)], want)


def test_results_are_whole_arrays():
    for shape in ((2,), (3, 2), (300_000, 2), (3, 4, 2), (3,), (2, 3)):
        u = collide.resolve(1.0, 2.0, np.ones(shape), np.zeros(shape), [1.0, 0.5, 0.25][: shape[-1]])
        for a in u:
            assert (type(a), a.shape, a.dtype) == (np.ndarray, shape, np.float64)
            assert a.flags.c_contiguous and a.flags.owndata and a.flags.writeable
    assert isinstance(u, tuple) and u._fields == ("u1", "u2")


def test_axes_before_the_last_broadcast():
    rng = np.random.default_rng(0)
    m1, m2 = rng.random((5, 1)) + 0.1, rng.random(4) + 0.1
    v1, v2, n = rng.normal(size=(5, 4, 2)), rng.normal(size=(4, 2)), rng.normal(size=2)
    u1, u2 = collide.resolve(m1, m2, v1, v2, n, restitution=rng.random((3, 1, 1)))
    assert u1.shape == u2.shape == (3, 5, 4, 2)
    one = collide.resolve(m1[3, 0], m2[1], v1[3, 1], v2[1], n, restitution=1.0)
    assert [*collide.resolve(m1, m2, v1, v2, n).u1[3, 1]] == [*one.u1]
    lists = collide.resolve([1, 2], 3, [[1, 2], [3, 4]], [0, 0], [1.0, 0.0])
    assert lists.u1.dtype == np.float64 and lists.u1.shape == (2, 2)


def frozen(shape):
    a = np.zeros(shape)
    a.flags.writeable = False
    return a


@pytest.mark.parametrize(
    ("change", "error", "message"),
    [
        ({"v1": 3.0}, ValueError, r"v1 has shape \(\): its last axis must have length 2 or 3, one a component"),
        ({"n": np.ones((4, 3))}, ValueError, r"n has shape \(4, 3\): its last axis must have length 2, as that of v1"),
        ({"v1": np.ones(3)}, ValueError, r"v2 has shape \(4, 2\): its last axis must have length 3, as that of v1"),
        ({"v2": np.ones((2, 4))}, ValueError, r"v2 has shape \(2, 4\): its last axis must have length 2 or 3"),
        ({"m1": np.ones(3)}, ValueError, r"the shapes .* do not broadcast together: m1 \(3,\), m2 \(4,\), v1 \(4, 2\)"),
        ({"v2": "ab"}, TypeError, "v2: the dtype <U2 is not supported"),
        ({"m2": 1j}, TypeError, "m2: the dtype complex128 is not supported"),
        ({"m1": np.zeros(4, "M8[D]")}, TypeError, "m1: the dtype .* is not supported"),
        ({"n": np.zeros((4, 2), "V8")}, TypeError, "n: the dtype .* is not supported"),
        ({"v2": np.ones((4, 2), complex)}, TypeError, "v2: the dtype complex128 is not supported"),
        ({"v1": np.ma.ones((4, 2))}, TypeError, "v1: masked arrays are not supported"),
        ({"out": (np.ones(4), np.ones(4))}, ValueError, r"out\[0\] has shape \(4,\): must have .* \(4, 2\)"),
        ({"out": [np.ones((4, 2))] * 2}, TypeError, "out = list: must be None or a tuple of 2 arrays"),
        ({"out": (np.ones((4, 2)), frozen((4, 2)))}, ValueError, r"out\[1\] is read-only"),
        ({"out": (np.ones((4, 2)),)}, ValueError, "out has 1 arrays: must have 2, for u1, u2"),
        ({"out": (np.ones((4, 2), "f4"),) * 2}, TypeError, r"out\[0\] has dtype float32"),
        ({"invalid": "no"}, ValueError, "invalid = 'no': must be one of"),
        ({"approaching_only": 1}, TypeError, "approaching_only = 1: must be True or False"),
    ],
)
def test_what_is_wrong_is_said_of_the_argument(change, error, message):
    good = {"m1": np.ones(4), "m2": np.ones(4), "v1": np.ones((4, 2)), "v2": np.zeros((4, 2)), "n": np.ones((4, 2))}
    with pytest.raises(error, match=f"^{message}"):
        collide.resolve(**good | change)


def test_an_invalid_pair_is_named_by_the_leading_axes():
    v1 = np.ones((3, 4, 2))
    v1[2, 1, 1] = np.nan
    out = np.zeros((3, 4, 2)), np.zeros((3, 4, 2))
    with pytest.raises(collide.InvalidPairError, match=r"^pair \(2, 1\): v1y = nan: must be finite$") as caught:
        collide.resolve(1.0, 1.0, v1, [0.0, 0.0], [1.0, 0.0], out=out)
    assert (caught.value.index, caught.value.count) == ((2, 1), 1)
    assert (out[1][..., 0] == np.where(np.arange(12).reshape(3, 4) == 9, 0.0, 1.0)).all()
    with pytest.raises(collide.InvalidPairError, match=r"^nx = ny = 0: the normal must have a length") as caught:
        collide.resolve(1.0, 1.0, [1.0, 0.0], [0.0, 0.0], [0.0, 0.0])
    assert caught.value.index == ()
    u = collide.resolve(1.0, 1.0, v1, [0.0, 0.0], [1.0, 0.0], invalid="nan")
    assert np.isnan(u.u1[2, 1]).all() and np.isfinite(np.delete(u.u1.reshape(12, 2), 9, axis=0)).all()


@pytest.mark.parametrize("dtype", ["f8", "f4"])
@pytest.mark.parametrize("step", [-8, 11, 13, 24, 40])
def test_kernels_take_odd_steps_themselves(dtype, step):
    """However Numba has come to know misaligned arrays in this process: read-only ones it takes."""
    form, n = FORMS["1d"], 21
    c = columns_of("1d", n, dtype)
    want = call("1d", c)
    given = [stepped(x, step) for x in c]
    for x in given:
        x.flags.writeable = False
    out = [np.empty(n, dtype) for _ in want]
    storage = 2 * np.dtype(dtype).char
    assert form.kernels[storage].compiled(*given, *out, np.empty(6), 0, n, 0, False, True) >= 0
    assert_same_bits(out, want)

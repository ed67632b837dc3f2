"""Pairs with normals of their own, resolved in list order, against the one-pair formula taken along the list."""

import copy

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.lib.stride_tricks import as_strided

import collide
from collide._pairs.vectors import FORMS
from collide._system import threads as _threads
from tests.helpers.sizes import sizes

INF = np.inf
DIMENSIONS = [*FORMS]
SCALAR = {d: (getattr(collide.scalar, f"resolve_{d}d"), getattr(collide.scalar, f"impulse_{d}d")) for d in DIMENSIONS}
BATCH = {d: getattr(collide, f"impulse_{d}d") for d in DIMENSIONS}
N = 200


def one_after_another(i, j, m, v, n, restitution=1.0, approaching_only=False):
    """The same in plain Python: velocities, impulses, and how many were resolved."""
    d = v.shape[1]
    resolve, impulse_of = SCALAR[d]
    v, impulse, resolved = v.copy(), np.zeros(len(i)), 0
    m, n, e = np.broadcast_to(m, len(v)), np.broadcast_to(n, (len(i), d)), np.broadcast_to(restitution, len(i))
    for k, (a, b) in enumerate(zip(i, j, strict=True)):
        before = v[[a, b]].astype(float)
        if not approaching_only or (before[0] - before[1]) @ n[k] > 0:
            pair = m[a], m[b], *before.ravel(), *n[k], e[k]
            impulse[k] = impulse_of(*pair)
            v[[a, b]] = np.reshape(resolve(*pair), (2, d))  # rounded to its dtype
            resolved += 1
    return v, impulse, resolved


def state(d, size, rng, n_balls=N):
    i, j = rng.integers(0, n_balls, (2, size))
    i, j = i[i != j], j[i != j]
    return i, j, rng.uniform(0.1, 5.0, n_balls), rng.normal(size=(n_balls, d)), rng.normal(size=(i.size, d))


def spaced(v):
    """Every second place of larger memory, of which the rest must stay as it is."""
    room = np.full((2 * len(v), 2 * v.shape[1]), 7.0, v.dtype)
    room[::2, ::2] = v
    return room[::2, ::2]


# How velocities may lie; and how to get rows of them back.
LAYOUTS = {
    "rows": lambda v: v.copy(),
    "Fortran's order": lambda v: np.asfortranarray(v),
    "backwards": lambda v: v[::-1].copy()[::-1],
    "with gaps": spaced,
    "columns": lambda v: tuple(c.copy() for c in v.T),
    "columns of a table": lambda v: tuple(np.hstack([v, v]).T[: v.shape[1]]),
    "columns askew": lambda v: tuple(askew(c) for c in v.T),
}


def askew(a):
    """Not aligned."""
    return np.frombuffer(bytearray(b"\0" + a.tobytes()), np.uint8)[1:].view(a.dtype)


def rows_of(v):
    return np.stack(v, axis=1) if isinstance(v, tuple | list) else v


@pytest.mark.parametrize("d", DIMENSIONS)
@pytest.mark.parametrize("layout", LAYOUTS)
@pytest.mark.parametrize("dtype", [np.float64, np.float32])
def test_layouts(layout, dtype, d):
    i, j, m, v, n = state(d, 300, np.random.default_rng(0))
    v = v.astype(dtype)
    want, impulses, resolved = one_after_another(i, j, m, v, n)
    given, impulse = LAYOUTS[layout](v), np.full(i.size, 9.0)
    assert collide.resolve_pairs(i, j, m, given, n, impulse=impulse) == resolved == i.size
    np.testing.assert_array_equal(rows_of(given), want)
    assert rows_of(given).dtype == dtype
    np.testing.assert_array_equal(impulse, impulses)


def test_what_lies_between_the_velocities_stays():
    v = spaced(np.eye(2))
    collide.resolve_pairs([0], [1], 1.0, v, [1.0, 0.0])
    room = v.base.copy()
    assert v.tolist() == [[0.0, 0.0], [1.0, 1.0]]
    room[::2, ::2] = 7.0
    assert (room == 7.0).all()


@pytest.mark.parametrize("d", DIMENSIONS)
@pytest.mark.parametrize("masses", ["one", "each", "walls"])
@pytest.mark.parametrize("restitution", ["elastic", "each"])
@pytest.mark.parametrize("approaching_only", [False, True])
@sizes(usual=1000, campaign=3000)
def test_each_pair_sees_what_the_earlier_ones_left(d, masses, restitution, approaching_only, size):
    rng = np.random.default_rng(1)
    i, j, m, v, n = state(d, size, rng)
    if masses == "one":
        m = 2.0
    elif masses == "walls":
        m = np.where(rng.random(N) < 0.1, INF, np.where(rng.random(N) < 0.1, 0.0, m))
        keep = (np.isfinite(m[i]) | np.isfinite(m[j])) & (m[i] + m[j] > 0)
        i, j, n = i[keep], j[keep], n[keep]
    e = 1.0 if restitution == "elastic" else rng.uniform(0, 1, i.size)
    want, impulses, resolved = one_after_another(i, j, m, v, n, e, approaching_only)
    impulse, options = np.full(i.size, 9.0), {"restitution": e, "approaching_only": approaching_only}
    assert collide.resolve_pairs(i, j, m, v, n, **options, impulse=impulse) == resolved
    assert (0.3 * i.size < resolved < 0.7 * i.size) if approaching_only else resolved == i.size
    np.testing.assert_array_equal(v, want)
    np.testing.assert_array_equal(impulse, impulses)
    assert bool((impulse >= 0).all()) == approaching_only


def normals(n):
    """Ways to give the same."""
    yield n
    yield np.asfortranarray(n)
    yield tuple(n.T)
    yield n.tolist()  # rows
    yield np.repeat(n, 2, axis=0)[::2]
    yield tuple(c.tolist() for c in n.T)
    yield n.astype(">f8")


@pytest.mark.fast
@pytest.mark.parametrize("d", DIMENSIONS)
def test_normals(d):
    i, j, m, v, n = state(d, 100, np.random.default_rng(2))
    n[:, 0] = 0.5
    want, *_ = one_after_another(i, j, m, v, n)
    for way in [*normals(n), (0.5, *n.T[1:]), (np.array([0.5]), *n.T[1:])]:
        u = v.copy()
        collide.resolve_pairs(i, j, m, u, way)
        np.testing.assert_array_equal(u, want)
    narrow, u = n.astype(np.float32), v.copy()
    collide.resolve_pairs(i, j, m, u, narrow)
    np.testing.assert_array_equal(u, one_after_another(i, j, m, v, narrow.astype(float))[0])


@pytest.mark.fast
@pytest.mark.parametrize("d", DIMENSIONS)
def test_one_normal_for_all(d):
    i, j, m, v, n = state(d, 100, np.random.default_rng(3))
    want, *_ = one_after_another(i, j, m, v, n[0])
    for way in (n[0], tuple(n[0]), n[0].tolist(), [*n[0]], np.broadcast_to(n[0], n.shape)):
        u = v.copy()
        collide.resolve_pairs(i, j, m, u, way)
        np.testing.assert_array_equal(u, want)


def test_rows_are_not_taken_for_columns():
    """Where there are as many pairs as components."""
    n, v = [[1.0, 0.0], [1.0, 1.0]], np.array([[1.0, 0.0], [0.0, 0.0], [2.0, 0.0], [0.0, 0.0]])
    by_rows, by_columns = v.copy(), v.copy()
    collide.resolve_pairs([0, 2], [1, 3], 1.0, by_rows, n)
    collide.resolve_pairs([0, 2], [1, 3], 1.0, by_columns, tuple(n))
    assert by_rows.tolist() == [[0.0, 0.0], [1.0, 0.0], [1.0, -1.0], [1.0, 1.0]]
    assert by_columns.tolist() == [[0.5, -0.5], [0.5, 0.5], [2.0, 0.0], [0.0, 0.0]]


# Lists in which no ball comes twice.


def apart(d, n_balls, rng):
    i, j = rng.permutation(n_balls).reshape(2, -1)
    return i, j, rng.uniform(0.1, 5.0, n_balls), rng.normal(size=(n_balls, d)), rng.normal(size=(i.size, d))


@pytest.fixture
def shared(monkeypatch):
    """How many pairs were shared out among threads, call by call."""
    calls, run = [], _threads.run

    def watched(task, n, **options):
        calls.append(n)
        return run(task, n, **options)

    monkeypatch.setattr(_threads, "run", watched)
    return calls


@pytest.mark.usefixtures("keep_threads")
@pytest.mark.parametrize("d", DIMENSIONS)
@pytest.mark.parametrize("layout", ["rows", "columns"])
def test_any_number_of_threads(layout, d, shared):
    i, j, m, v, n = apart(d, 140_000, np.random.default_rng(4))
    bad = np.array([49_000, 20_000, 30_000])
    m[i[bad]] = -1.0, -2.0, -3.0
    given = {"restitution": 0.9, "approaching_only": True}
    u1, u2 = collide.resolve(m[i], m[j], v[i], v[j], n, **given, invalid="keep")
    want = np.empty_like(v)
    want[i], want[j] = u1, u2
    impulses = BATCH[d](m[i], m[j], *v[i].T, *v[j].T, *n.T, **given, invalid="keep")
    results = []
    for threads in (1, 2, 7):
        collide.set_num_threads(threads)
        u, impulse = LAYOUTS[layout](v), np.full(i.size, 9.0)
        with pytest.raises(collide.InvalidPairError) as info:
            collide.resolve_pairs(i, j, m, u, n, **given, impulse=impulse)
        assert (info.value.index, info.value.count) == ((20_000,), 3)
        assert info.value.reason.startswith(f"balls {i[20_000]} and {j[20_000]}, as 1 and 2: m1 = -2.0: a mass must be")
        np.testing.assert_array_equal(rows_of(u), want)
        np.testing.assert_array_equal(impulse, impulses)
        u = LAYOUTS[layout](v)
        count = collide.resolve_pairs(i, j, m, u, n, **given, invalid="nan")
        results.append((count, rows_of(u).tobytes()))
    assert results[0] == results[1] == results[2]
    assert results[0][0] == np.count_nonzero(impulses)
    assert np.isnan(rows_of(u)).all(axis=1).sum() == 2 * bad.size
    assert shared == [i.size] * 4  # not with one thread


@pytest.mark.usefixtures("keep_threads")
@pytest.mark.parametrize("again", ["i", "j"])
def test_a_ball_that_comes_twice_keeps_the_order(again, shared):
    rng = np.random.default_rng(5)
    i, j, m, v, n = apart(2, 140_000, rng)
    pairs = {"i": i, "j": j}
    pairs[again][-1] = j[0] if again == "i" else i[0]  # the first and the last pair
    collide.set_num_threads(4)
    u = v.copy()
    collide.resolve_pairs(i, j, m, u, n)
    for part in (slice(None, -1), slice(-1, None)):
        collide.resolve_pairs(i[part], j[part], m, v, n[part])
    np.testing.assert_array_equal(u, v)
    assert shared == [i.size - 1]


@pytest.mark.usefixtures("keep_threads")
def test_few_pairs_among_many_balls_need_no_mark_for_each(shared):
    i, j, *_, n = apart(2, 140_000, np.random.default_rng(6))
    collide.set_num_threads(2)
    collide.resolve_pairs(i, j, 1.0, np.zeros((8 * i.size + 1, 2)), n)
    assert shared == []
    collide.resolve_pairs(i, j, 1.0, np.zeros((8 * i.size, 2)), n)
    assert shared == [i.size]


# Invalid pairs. What is right is what a batch of one pair gives.

ODD = st.sampled_from([0.0, -0.0, 1.0, -1.0, 2.0, 0.5, 3.0, INF, -INF, np.nan, 1e30, -1e30, 3e38, -3e38])
WIDE = st.one_of(ODD, st.sampled_from([1e308, -1.7e308, 1e200, 5e-324, 1e-200]))


def pair_by_pair(i, j, m, v, n, e, approaching_only, invalid):
    """By batches of one: velocities, impulses, how many were resolved, and which were invalid."""
    d, dtype = v.shape[1], v.dtype
    v, impulse, resolved, wrong = v.copy(), np.zeros(len(i)), 0, []
    options = {"approaching_only": approaching_only}
    for k, (a, b) in enumerate(zip(i, j, strict=True)):
        m1, m2, restitution = m[a : a + 1], m[b : b + 1], e[k : k + 1]
        wide = m1, m2, *v[[a]].T.astype(float), *v[[b]].T.astype(float), *n[[k]].T
        try:
            u1, u2 = collide.resolve(
                *(c.astype(dtype) for c in (m1, m2)), v[[a]], v[[b]], n[[k]].astype(dtype),
                restitution=restitution.astype(dtype), **options
            )  # fmt: skip
            p = BATCH[d](*wide, restitution=restitution, **options)
        except collide.InvalidPairError:
            wrong.append(k)
            if invalid == "nan":
                v[[a, b]] = impulse[k] = np.nan
            continue
        left_alone = approaching_only and FORMS[d].step((*(c[0] for c in wide), restitution[0])).closing <= 0.0
        v[a], v[b], impulse[k] = u1[0], u2[0], p[0]
        resolved += not left_alone
    return v, impulse, resolved, wrong


@pytest.mark.parametrize("d", DIMENSIONS)
@pytest.mark.parametrize("dtype", [np.float64, np.float32])
@pytest.mark.filterwarnings("ignore:(overflow|invalid value|divide by zero) encountered:RuntimeWarning")
@settings(deadline=None)
@given(data=st.data())
def test_what_is_invalid_is_what_a_batch_has_it(d, dtype, data):
    values = WIDE if dtype is np.float64 else ODD
    numbers = lambda n: np.array(data.draw(st.lists(values, min_size=n, max_size=n)), dtype).astype(float)  # noqa: E731
    i, j = np.array([0, 2, 1, 0]), np.array([1, 3, 2, 3])
    m, v, n, e = numbers(4), numbers(4 * d).reshape(4, d).astype(dtype), numbers(4 * d).reshape(4, d), numbers(4)
    usual = data.draw(st.booleans())
    if usual:  # or nearly all pairs are invalid
        m, e = np.abs(np.where(np.isfinite(m), m, 1.0)), np.ones(4)
    approaching_only = data.draw(st.booleans())
    for invalid in ("keep", "nan", "raise"):
        want, impulses, resolved, wrong = pair_by_pair(i, j, m, v, n, e, approaching_only, invalid)
        u, impulse = v.copy(), np.full(4, 9.0)
        call = {"restitution": e, "approaching_only": approaching_only, "invalid": invalid, "impulse": impulse}
        if invalid == "raise" and wrong:
            with pytest.raises(collide.InvalidPairError) as info:
                collide.resolve_pairs(i, j, m, u, n, **call)
            assert (info.value.index, info.value.count) == ((wrong[0],), len(wrong))
            assert info.value.reason.startswith(f"balls {i[wrong[0]]} and {j[wrong[0]]}, as 1 and 2: ")
        else:
            assert collide.resolve_pairs(i, j, m, u, n, **call) == resolved
        np.testing.assert_array_equal(u, want)
        np.testing.assert_array_equal(impulse, impulses)


@pytest.mark.fast
def test_a_pair_that_earlier_ones_made_invalid():
    v = np.array([[8e307, 0.0], [0.0, 0.0], [-1.7e308, 0.0]])
    with pytest.raises(collide.InvalidPairError, match=r"pair 1: balls 1 and 2, as 1 and 2: the result .* too large"):
        collide.resolve_pairs([0, 1, 0], [1, 2, 1], 1.0, v, (1.0, 0.0))
    assert v.tolist() == [[8e307, 0.0], [0.0, 0.0], [-1.7e308, 0.0]]  # the last pair undoes the first
    v = np.array([[np.nan, 0.0], [0.0, 0.0], [1.0, 2.0]])
    with pytest.raises(collide.InvalidPairError, match=r"v1x = nan: must be finite$"):
        collide.resolve_pairs([0, 1], [1, 2], 1.0, v, (1.0, 0.0))


@pytest.mark.fast
def test_too_large_for_float32():
    v = np.array([[3e38, 0.0], [-3e38, 0.0]], np.float32)
    with pytest.raises(collide.InvalidPairError, match="too large for the dtype"):
        collide.resolve_pairs([0], [1], [3.0, 1.0], v, (1.0, 0.0))
    wide = v.astype(float)
    assert collide.resolve_pairs([0], [1], [3.0, 1.0], wide, (1.0, 0.0)) == 1
    assert v.tolist() == [[np.float32(3e38), 0.0], [np.float32(-3e38), 0.0]]


@pytest.mark.fast
def test_balls_at_rest_keep_their_zeros():
    v = np.array([[-0.0, 0.0], [0.0, -0.0]])
    assert collide.resolve_pairs([0], [1], INF, v, (1.0, 0.0), approaching_only=True) == 0
    assert np.signbit(v).tolist() == [[True, False], [False, True]]


@pytest.mark.fast
def test_nothing_to_do():
    v = np.ones((3, 2))
    assert collide.resolve_pairs([], [], 1.0, v, np.empty((0, 2)), impulse=np.empty(0)) == 0
    assert collide.resolve_pairs([], [], 1.0, v, (1.0, 0.0)) == 0
    assert collide.resolve_pairs([], [], 1.0, np.empty((0, 2)), (1.0, 0.0)) == 0
    assert (v == 1.0).all()


# Arguments.


def frozen(*shape):
    array = np.zeros(shape)
    array.flags.writeable = False
    return array


def arguments():
    return {
        "i": np.array([0, 1]),
        "j": np.array([1, 2]),
        "m": 1.0,
        "v": np.array([[3.0, 0.0], [2.0, 0.0], [1.0, 0.0]]),
        "n": np.array([[1.0, 0.0], [1.0, 1.0]]),
        "impulse": np.full(2, 9.0),
    }


SHARED = np.zeros(4)
LENGTHS = " or ".join(map(str, DIMENSIONS))


@pytest.mark.fast
@pytest.mark.parametrize(
    ("change", "error", "message"),
    [
        ({"i": [0, 3]}, IndexError, r"i\[1\] = 3: must be the number of one of the 3 balls"),
        ({"j": [-1, 2]}, IndexError, r"j\[0\] = -1: must be the number of one of the 3 balls"),
        ({"j": np.array([2**63, 2], np.uint64)}, IndexError, r"j\[0\] = 9223372036854775808: must be the number"),
        ({"i": [0, 2]}, ValueError, r"i\[1\] = j\[1\] = 2: a ball cannot collide with itself"),
        ({"i": [0.0, 1.0]}, TypeError, "i has dtype float64: must have an integer dtype"),
        ({"j": [1]}, ValueError, r"j has shape \(1,\): must have that of i, \(2,\)"),
        ({"m": [1.0, 1.0]}, ValueError, r"m has shape \(2,\): must have that of the balls, \(3,\)"),
        ({"m": "heavy"}, TypeError, "m: the dtype <U5 is not supported"),
        ({"restitution": [1.0, 1.0, 1.0]}, ValueError, r"restitution has shape \(3,\): must have that of i, \(2,\)"),
        (
            {"v": np.zeros((3, 4))},
            ValueError,
            rf"v has shape \(3, 4\): must be \(N, {LENGTHS}\), a row a ball, or a tup",
        ),
        ({"v": np.zeros(3)}, ValueError, rf"v has shape \(3,\): must be \(N, {LENGTHS}\), a row a ball, or a tuple of"),
        ({"v": [[0.0, 0.0]] * 2}, TypeError, "v is of type list: must be a NumPy array, as it is written to"),
        ({"v": [np.zeros(3), np.zeros(3)]}, TypeError, "v is of type list: must be a NumPy array, as it is written to"),
        (
            {"v": ([[0.0], [0.0, 0.0]], 1)},
            TypeError,
            r"v\[0\] is of type list: must be a NumPy array, as it is written",
        ),
        ({"v": "fast"}, TypeError, r"v is of type str: must be a NumPy array, as it is written to"),
        ({"v": np.ma.zeros((3, 2))}, TypeError, "v is of type MaskedArray: must be a NumPy array"),
        ({"v": np.zeros((3, 2), int)}, TypeError, "v has dtype int64: must have float64 or float32"),
        ({"v": np.zeros((3, 2), ">f8")}, TypeError, "v has dtype >f8: must have float64 or float32"),
        ({"v": frozen(3, 2)}, ValueError, "v is read-only"),
        ({"v": ()}, ValueError, f"v has 0 arrays: must have {LENGTHS}, one a component"),
        ({"v": (np.zeros((3, 2)), np.zeros(3))}, ValueError, r"v\[0\] has shape \(3, 2\): must be one-dimensional"),
        ({"v": (np.zeros(3), np.zeros(4))}, ValueError, r"v\[1\] has shape \(4,\): must have that of v\[0\], \(3,\)"),
        ({"v": (np.zeros(3), frozen(3))}, ValueError, r"v\[1\] is read-only"),
        (
            {"v": (np.zeros(3), np.zeros(3, "f"))},
            TypeError,
            r"v\[1\] has dtype float32: must have that of v\[0\], float",
        ),
        ({"v": (SHARED[1:], SHARED[:3])}, ValueError, r"v\[0\] and v\[1\] share memory"),
        ({"v": (SHARED[1:], np.zeros(3)), "impulse": SHARED[:2]}, ValueError, r"v\[0\] and impulse share memory"),
        (
            {"n": np.zeros((3, 2))},
            ValueError,
            r"n has shape \(3, 2\): must have \(2, 2\), a row a pair, or \(2,\), one",
        ),
        ({"n": 1.0}, ValueError, r"n has shape \(\): must have \(2, 2\), a row a pair, or \(2,\), one for all"),
        ({"n": (1.0, 0.0, 0.0)}, ValueError, "n has 3 components: must have 2, as v has"),
        ({"n": (1.0, [1.0, 1.0, 1.0])}, ValueError, r"n\[1\] has shape \(3,\): must have that of i, \(2,\)"),
        ({"n": (1.0, "up")}, TypeError, r"n\[1\]: the dtype <U2 is not supported"),
        ({"n": "up"}, TypeError, "n: the dtype <U2 is not supported"),
        ({"impulse": np.zeros(3)}, ValueError, r"impulse has shape \(3,\): must have that of i, \(2,\)"),
        ({"impulse": np.zeros(2, np.float32)}, TypeError, "impulse has dtype float32: must have float64"),
        ({"impulse": [0.0, 0.0]}, TypeError, "impulse is of type list: must be a NumPy array, as it is written to"),
        ({"impulse": frozen(2)}, ValueError, "impulse is read-only"),
        ({"invalid": "ignore"}, ValueError, "invalid = 'ignore': must be one of 'raise', 'keep', 'nan'"),
        ({"approaching_only": 1}, TypeError, "approaching_only = 1: must be True or False"),
    ],
)
def test_bad_input_is_refused_before_anything_is_written(change, error, message):
    given = arguments() | change
    before = copy.deepcopy((given["v"], given["impulse"]))
    with pytest.raises(error, match=f"^{message}"):
        collide.resolve_pairs(**given)
    assert repr((given["v"], given["impulse"])) == repr(before)


@pytest.mark.fast
@pytest.mark.parametrize("d", DIMENSIONS)
def test_inputs_may_lie_where_results_go(d):
    """What counts are their values before."""
    i, j, _, v, _ = state(d, 150, np.random.default_rng(7))
    n, e = v[: i.size] + 0.5, np.abs(v.ravel()[: i.size])
    want, impulses, _ = one_after_another(i, j, np.abs(v[:, 0]), v, n, e)
    u, impulse = v.copy(), e.copy()
    collide.resolve_pairs(i, j, np.abs(v[:, 0]), u, n, restitution=impulse, impulse=impulse)
    np.testing.assert_array_equal(u, want)
    np.testing.assert_array_equal(impulse, impulses)

    # The masses are a component, the normals velocities, the numbers of balls are where impulses go.
    u = np.abs(v) + 0.1
    want, *_ = one_after_another(i, j, u[:, 0], u, u[: i.size])
    places = i.copy()
    collide.resolve_pairs(places, j, u[:, 0], u, u[: i.size], impulse=places.view(np.float64))
    np.testing.assert_array_equal(u, want)


@pytest.mark.fast
def test_velocities_in_one_place():
    """Of an array without a step the last written counts; nothing beside it is touched."""
    room = np.array([1.0, 7.0])
    v = as_strided(room, (3,), (0,)), np.zeros(3)
    assert collide.resolve_pairs([0], [1], [1.0, INF, 1.0], v, (1.0, 0.0)) == 1
    assert room[1] == 7.0


def test_a_memory_map(tmp_path):
    v = np.lib.format.open_memmap(tmp_path / "v.npy", "w+", np.float32, (3, 2))
    v[0] = 2.0, 0.0
    assert collide.resolve_pairs([0, 1], [1, 2], 1.0, v, (1.0, 0.0)) == 2
    assert np.load(tmp_path / "v.npy").tolist() == [[0.0, 0.0], [0.0, 0.0], [2.0, 0.0]]

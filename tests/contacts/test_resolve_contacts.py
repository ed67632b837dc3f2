"""Contacts resolved in list order, against the one-pair formula taken along the list."""

import itertools

import numpy as np
import pytest

import collide
from tests.helpers.sizes import sizes

INF = np.inf


def in_order(i, j, m, x, y, vx, vy, restitution=1.0, box=None):
    """The same, pair after pair in plain Python: velocities, impulses, and how many approached."""
    vx, vy, impulse, resolved = vx.copy(), vy.copy(), np.zeros(len(i)), 0
    m, e = np.broadcast_to(m, x.shape), np.broadcast_to(restitution, len(i))
    x, y = (c if side is None else c % side for c, side in zip((x, y), box or (None, None), strict=True))
    for k, (a, b) in enumerate(zip(i, j, strict=True)):
        n = x[b] - x[a], y[b] - y[a]
        nx, ny = (
            d if side is None else d - side * np.rint(d / side) for d, side in zip(n, box or (None, None), strict=True)
        )
        pair = m[a], m[b], vx[a], vy[a], vx[b], vy[b], nx, ny, e[k]
        if (vx[a] - vx[b]) * nx + (vy[a] - vy[b]) * ny > 0:
            impulse[k] = collide.scalar.impulse_2d(*pair)
            vx[a], vy[a], vx[b], vy[b] = collide.scalar.resolve_2d(*pair)
            resolved += 1
    return vx, vy, impulse, resolved


def state(n, rng):
    return rng.uniform(0.0, 10.0, (2, n)), rng.normal(size=(2, n)), rng.uniform(0.1, 5.0, n)


@pytest.mark.parametrize("box", [None, (10.0, 7.0), (10.0, None), (None, 7.0), (None, None)])
@pytest.mark.parametrize("masses", ["one", "each", "walls"])
@pytest.mark.parametrize("restitution", ["elastic", "each"])
@sizes(usual=1000, campaign=3000)
def test_each_pair_sees_what_the_earlier_ones_left(box, masses, restitution, size):
    rng = np.random.default_rng(0)
    (x, y), (vx, vy), m = state(200, rng)
    m = {"one": 2.0, "each": m, "walls": np.where(rng.random(200) < 0.1, INF, m)}[masses]
    i, j = rng.integers(0, 200, (2, size))
    keep = (i != j) & (np.isfinite(np.broadcast_to(m, 200))[i] | np.isfinite(np.broadcast_to(m, 200))[j])
    i, j = i[keep], j[keep]
    e = 1.0 if restitution == "elastic" else rng.uniform(0, 1, i.size)
    *want, resolved = in_order(i, j, m, x, y, vx, vy, e, box)
    impulse = np.full(i.size, 9.0)
    assert collide.resolve_contacts(i, j, m, x, y, vx, vy, restitution=e, box=box, impulse=impulse) == resolved > 200
    for got, exact in zip((vx, vy, impulse), want, strict=True):
        np.testing.assert_array_equal(got, exact)


@pytest.mark.usefixtures("keep_threads")
def test_a_gas_keeps_momentum_and_energy_on_any_number_of_threads():
    rng = np.random.default_rng(1)
    n = 100_000
    side = np.sqrt(n * np.pi / 0.5)
    x, y = rng.uniform(0, side, (2, n))
    v = rng.normal(size=(2, n))
    results = []
    for threads in (1, 2, 8):
        collide.set_num_threads(threads)
        u = v.copy()
        i, j = collide.find_contacts(x, y, 1.0, box=(side, side))
        count = collide.resolve_contacts(i, j, 3.0, x, y, *u, box=(side, side))
        results.append((count, u.tobytes()))
    assert results[0] == results[1] == results[2]
    assert 0.4 * i.size < count < 0.6 * i.size
    np.testing.assert_allclose(u.sum(axis=1), v.sum(axis=1), atol=1e-10)
    assert abs((u * u).sum() / (v * v).sum() - 1) < 1e-13


@pytest.mark.fast
def test_the_nearest_image_is_hit():
    vx, vy = np.array([-1.0, 0.0]), np.zeros(2)
    args = [0], [1], 1.0, [0.5, 9.5], [0.0, 40.0], vx, vy
    assert collide.resolve_contacts(*args) == 0
    assert collide.resolve_contacts(*args, box=(None, 10.0)) == 0
    assert collide.resolve_contacts(*args, box=(10.0, 10.0)) == 1
    assert vx.tolist() == [0.0, -1.0]


def test_far_outside_the_box_the_nearest_image_is_that_of_the_search():
    x, y, box = np.array([0.02, 1e9 + 0.03]), np.array([0.0, 0.0]), (0.1, 0.1)
    v, inside = np.array([1.0, 0.0]), np.array([1.0, 0.0])
    vy, vy_inside = np.array([0.0, 1.0]), np.array([0.0, 1.0])
    collide.resolve_contacts([0], [1], 1.0, x, y + 0.01, v, vy, box=box)
    collide.resolve_contacts([0], [1], 1.0, x % 0.1, y + 0.01, inside, vy_inside)
    np.testing.assert_array_equal((v, vy), (inside, vy_inside))
    assert collide.resolve_contacts([0], [1], 1.0, [0.0, 1e200], [0.0, 1.0], *np.eye(2), box=(1e-150, 3.0)) in (0, 1)


@pytest.mark.fast
def test_balls_at_rest_are_not_resolved():
    for m in (1.0, INF):
        vx, vy = np.array([-0.0, 0.0]), np.array([0.0, -0.0])
        assert collide.resolve_contacts([0], [1], m, [0.0, 1.0], [0.0, 0.0], vx, vy) == 0
        assert np.signbit([*vx, *vy]).tolist() == [True, False, False, True]


@pytest.mark.fast
def test_an_impulse_that_is_too_large():
    args = [0], [1], 1e200, [0.0, 1.0], [0.0, 0.0]
    vx = np.array([1e200, 0.0])
    with pytest.raises(collide.InvalidPairError, match="too large"):
        collide.resolve_contacts(*args, vx, np.zeros(2), impulse=np.zeros(1))
    assert vx.tolist() == [1e200, 0.0]
    assert collide.resolve_contacts(*args, vx, np.zeros(2)) == 1  # nobody asks for the impulse
    assert vx.tolist() == [0.0, 1e200]


def test_nothing_to_do():
    v = np.ones(3)
    assert collide.resolve_contacts([], [], 1.0, np.ones(3), np.ones(3), v, np.ones(3)) == 0
    assert collide.resolve_contacts([], [], 1.0, [], [], np.empty(0), np.empty(0), impulse=np.empty(0)) == 0
    assert v.tolist() == [1.0, 1.0, 1.0]


# Five balls on a line, 0 and 1 collide, as do 3 and 4; what stands between them is invalid.
POSITION = np.array([0.0, 1.0, 2.0, 3.0, 4.0])
SPEED = np.array([1.0, 0.0, 0.0, 1.0, 0.0])
BROKEN = {
    "m1 = -1.0: a mass must be >= 0": {"m": [1, -1, 1, 1, 1]},
    "m2 = nan: a mass must be >= 0": {"m": [1, 1, np.nan, 1, 1]},
    "m1 = m2 = 0: one mass of a pair must be above 0": {"m": [1, 0, 0, 1, 1]},
    "nx = ny = 0: the normal must have a length": {"x": [0, 1, 1, 3, 4]},
    "nx = nan: must be finite": {"x": [0, 1, np.nan, 3, 4]},
    "nx = inf: must be finite": {"x": [0, 1, INF, 3, 4]},
    "v2y = nan: must be finite": {"vy": [0, 0, np.nan, 0, 0]},
    "v2x = inf: must be finite": {"vx": [1, 0, INF, 1, 0]},
    "restitution = -0.5: must be finite and >= 0": {"restitution": [1.0, -0.5, 1.0]},
    "restitution = inf: must be finite and >= 0": {"restitution": [1.0, INF, 1.0]},
    "the result of the collision, or a step on the way to it, is too large": {
        "vx": [1, 0, -1.7e308, 1, 0],
        "m": [0.25, 1, 3, 1, 1],
    },
}


def broken(change):
    s = {"m": np.ones(5), "x": POSITION, "y": np.zeros(5), "vx": SPEED, "vy": np.zeros(5), "restitution": 1.0} | change
    s = {name: np.array(value, float) for name, value in s.items()}
    options = {"restitution": s.pop("restitution"), "impulse": np.full(3, 9.0)}
    return ([0, 1, 3], [1, 2, 4], *s.values()), options


@pytest.mark.fast
@pytest.mark.parametrize("reason", BROKEN)
@pytest.mark.parametrize("invalid", ["raise", "keep", "nan"])
def test_invalid_pairs(reason, invalid):
    args, options = broken(BROKEN[reason])
    *_, vx, vy = args
    before = vx.copy(), vy.copy()
    first = 1
    if reason.startswith("m1 = -1.0"):
        first = 0  # as ball 2 of the pair before
        args[0][0], args[1][0] = 1, 2
    if invalid == "raise":
        with pytest.raises(collide.InvalidPairError) as info:
            collide.resolve_contacts(*args, **options)
        assert info.value.index == (first,)
        assert info.value.reason.startswith(f"balls 1 and 2, as 1 and 2: {reason}")
    else:
        assert collide.resolve_contacts(*args, **options, invalid=invalid) == (1 if first == 0 else 2)
    assert (vx[3], vx[4]) == (0.0, 1.0)
    assert options["impulse"][2] > 0
    if invalid == "nan":
        assert np.isnan([vx[1], vy[1], vx[2], vy[2], options["impulse"][1]]).all()
    else:
        assert options["impulse"][1] == 0.0
        np.testing.assert_array_equal((vx[2], vy[2]), (before[0][2], before[1][2]))


def test_nan_makes_later_pairs_of_its_balls_invalid():
    vx = np.array([1.0, 0.0, 0.0, 0.0])
    with pytest.raises(collide.InvalidPairError, match="2 invalid pairs in all") as info:
        collide.resolve_contacts([0, 1, 2], [1, 2, 3], [-1.0, 1, 1, -1], POSITION[:4], np.zeros(4), vx, np.zeros(4))
    assert info.value.index == (0,)
    vx = np.array([1.0, 0.0, 0.0, 0.0])
    collide.resolve_contacts(
        [0, 1, 2], [1, 2, 3], [-1.0, 1, 1, 1], POSITION[:4], np.zeros(4), vx, np.zeros(4), invalid="nan"
    )
    assert np.isnan(vx).all()


def test_two_immovable_balls_matter_only_where_they_approach():
    args = [0], [1], INF, [0.0, 1.0], [0.0, 0.0]
    assert collide.resolve_contacts(*args, np.array([-1.0, 0.0]), np.zeros(2)) == 0
    with pytest.raises(collide.InvalidPairError, match="m1 = m2 = inf: two immovable balls cannot collide"):
        collide.resolve_contacts(*args, np.array([1.0, 0.0]), np.zeros(2))


def arguments():
    return {
        "i": np.array([0, 1]),
        "j": np.array([1, 2]),
        "m": 1.0,
        "x": np.arange(3.0),
        "y": np.zeros(3),
        "vx": np.array([3.0, 2.0, 1.0]),
        "vy": np.zeros(3),
        "impulse": np.full(2, 9.0),
    }


def frozen(n):
    array = np.zeros(n)
    array.flags.writeable = False
    return array


SHARED = np.zeros(4)


@pytest.mark.fast
@pytest.mark.parametrize(
    ("change", "error", "message"),
    [
        ({"i": [0, 3]}, IndexError, r"i\[1\] = 3: must be the number of one of the 3 balls"),
        ({"j": [-1, 2]}, IndexError, r"j\[0\] = -1: must be the number of one of the 3 balls"),
        ({"j": np.array([2**63, 2], np.uint64)}, IndexError, r"j\[0\] = 9223372036854775808: must be the number"),
        ({"i": [0, 2]}, ValueError, r"i\[1\] = j\[1\] = 2: a ball cannot collide with itself"),
        ({"i": [0.0, 1.0]}, TypeError, "i has dtype float64: must have an integer dtype"),
        ({"j": [True, True]}, TypeError, "j has dtype bool: must have an integer dtype"),
        ({"j": [1]}, ValueError, r"j has shape \(1,\): must have that of i, \(2,\)"),
        ({"i": 0}, ValueError, r"i has shape \(\): must be one-dimensional"),
        ({"y": np.zeros(4)}, ValueError, r"y has shape \(4,\): must have that of x, \(3,\)"),
        ({"m": [1.0, 1.0]}, ValueError, r"m has shape \(2,\): must have that of x, \(3,\)"),
        ({"restitution": [1.0, 1.0, 1.0]}, ValueError, r"restitution has shape \(3,\): must have that of i, \(2,\)"),
        ({"vx": np.zeros(2)}, ValueError, r"vx has shape \(2,\): must have that of x, \(3,\)"),
        ({"vy": [0.0, 0.0, 0.0]}, TypeError, "vy is of type list: must be a NumPy array, as it is written to"),
        ({"vx": np.ma.zeros(3)}, TypeError, "vx is of type MaskedArray: must be a NumPy array"),
        ({"vx": np.zeros(3, np.float32)}, TypeError, "vy has dtype float64: must have that of vx, float32"),
        ({"vx": np.zeros(3, np.float16)}, TypeError, "vx has dtype float16: must have float64 or float32"),
        ({"vy": np.zeros(3, ">f8")}, TypeError, "vy has dtype >f8: must have float64 or float32"),
        ({"vx": np.zeros(3, int)}, TypeError, "vx has dtype int64: must have float64 or float32"),
        ({"vy": frozen(3)}, ValueError, "vy is read-only"),
        ({"impulse": np.zeros(3)}, ValueError, r"impulse has shape \(3,\): must have that of i, \(2,\)"),
        ({"impulse": frozen(2)}, ValueError, "impulse is read-only"),
        ({"impulse": np.zeros(2, np.float32)}, TypeError, "impulse has dtype float32: must have float64"),
        ({"radius": -1.0}, ValueError, "radius = -1.0: must be >= 0"),
        ({"radius": [1.0, -1.0, 1.0]}, ValueError, r"radius\[1\] = -1.0: must be >= 0"),
        ({"radius": np.nan}, ValueError, "radius = nan: must be finite"),
        ({"radius": [1.0, 1.0, INF]}, ValueError, r"radius\[2\] = inf: must be finite"),
        ({"radius": 1e150}, ValueError, r"2 radius = 2e\+150 for the largest ball: must be at most 1e\+150"),
        ({"radius": [1.0, 1.0]}, ValueError, r"radius has shape \(2,\): must have that of x, \(3,\)"),
        ({"radius": "large"}, TypeError, "radius: the dtype <U5 is not supported"),
        ({"vx": SHARED[1:], "vy": SHARED[:3]}, ValueError, "vx and vy share memory"),
        ({"vx": SHARED[1:], "impulse": SHARED[:2]}, ValueError, "vx and impulse share memory"),
        ({"invalid": "ignore"}, ValueError, "invalid = 'ignore': must be one of 'raise', 'keep', 'nan'"),
        ({"box": (0, 1)}, ValueError, r"box\[0\] = 0: must be from"),
        ({"m": "heavy"}, TypeError, "m: the dtype <U5 is not supported"),
    ],
)
def test_bad_input_is_refused_before_anything_is_written(change, error, message):
    given = arguments() | change
    before = {name: np.copy(given[name]) for name in ("vx", "vy", "impulse")}
    with pytest.raises(error, match=message):
        collide.resolve_contacts(**given)
    for name, old in before.items():
        np.testing.assert_array_equal((arguments() | change)[name], old)


@pytest.mark.fast
def test_strides_and_shared_memory():
    rng = np.random.default_rng(2)
    (x, y), (vx, vy), m = state(50, rng)
    i, j = np.array(list(itertools.combinations(range(50), 2))).T
    *want, _ = in_order(i, j, m, x, y, vx, vy)

    table = np.stack([x, y, vx, vy, m], axis=1)  # one row a ball: nothing is contiguous
    impulses = np.zeros((i.size, 2))
    collide.resolve_contacts(i, j, table[:, 4], *table.T[:4], impulse=impulses[:, 1])
    np.testing.assert_array_equal(table[:, 2:4].T, want[:2])
    np.testing.assert_array_equal(impulses.T, [np.zeros(i.size), want[2]])

    # The positions lie where the velocities are written: what counts are the positions before.
    u, uy = x.copy(), vy.copy()
    *want, _ = in_order(i, j, m, x, y, x, vy)
    collide.resolve_contacts(i.astype(np.int32), j.astype(np.uint8), m, u, y, u, uy)
    np.testing.assert_array_equal((u, uy), want[:2])


def test_restitution_may_lie_where_the_impulses_go():
    memory = np.array([1.0, 0.5, 0.25, 9.0])
    x, want = np.arange(4.0), np.empty(3)
    args = [0, 1, 2], [1, 2, 3], 1.0, x, np.zeros(4)
    collide.resolve_contacts(*args, 3.0 - x, np.zeros(4), restitution=memory[:3].copy(), impulse=want)
    collide.resolve_contacts(*args, 3.0 - x, np.zeros(4), restitution=memory[:3], impulse=memory[1:])
    np.testing.assert_array_equal(memory[1:], want)


def test_a_closing_speed_that_is_no_number_is_no_parting():
    """inf - inf: neither approaching nor not, and so invalid."""
    vx, vy = np.array([1.7e308, -1.7e308]), np.array([-1.7e308, 1.7e308])
    with pytest.raises(collide.InvalidPairError):
        collide.resolve_contacts([0], [1], 1.0, [0.0, 1.0], [0.0, 1.0], vx, vy)


def test_a_box_smaller_than_one():
    """The nearest image, askew: n is not along an axis."""
    x, y = np.array([0.05, 0.45]), np.array([0.05, 0.43])
    vx, vy = np.array([-1.0, 0.0]), np.array([0.0, 0.0])
    assert collide.resolve_contacts([0], [1], 1.0, x, y, vx, vy, box=(0.5, 0.5)) == 1
    u = collide.resolve_2d(1.0, 1.0, -1.0, 0.0, 0.0, 0.0, -0.1, -0.12)
    np.testing.assert_allclose([vx[0], vy[0], vx[1], vy[1]], u, rtol=1e-13, atol=1e-15)


# With radii: pairs that do not touch are left alone. What touches, find_contacts says.


def which_touch(i, j, x, y, radius, box=None):
    """Which of the pairs are resolved when both balls of each come straight at each other, and no two share a ball."""
    radius = np.broadcast_to(radius, np.shape(x))
    ball = np.concatenate([i, j])
    n = np.stack([(c % s)[j] - (c % s)[i] if box else c[j] - c[i] for c, s in zip((x, y), box or (0, 0), strict=True)])
    if box:
        n -= np.reshape(box, (2, 1)) * np.rint(n / np.reshape(box, (2, 1)))
    vx, vy = np.concatenate([n, -n], axis=1)
    k, impulse = np.arange(i.size), np.full(i.size, 9.0)
    options = {"radius": radius[ball], "box": box, "impulse": impulse}
    count = collide.resolve_contacts(k, k + i.size, 1.0, x[ball], y[ball], vx, vy, **options)
    assert count == np.count_nonzero(impulse)
    return impulse > 0.0


def found(x, y, radius, box=None):
    return set(zip(*(a.tolist() for a in collide.find_contacts(x, y, radius, box=box)), strict=True))


def all_pairs(n):
    return np.array(list(itertools.combinations(range(n), 2))).T


@pytest.mark.parametrize("box", [None, (8.0, 8.0), (8.5, 9.75)])
@pytest.mark.parametrize("radii", ["one", "each"])
@pytest.mark.parametrize("outside", [False, True])
def test_what_touches_is_what_find_contacts_finds(box, radii, outside):
    """On a grid of halves, where some pairs graze exactly, and off it; outside of the box as well."""
    rng = np.random.default_rng(3)
    for exact in (True, False):
        x, y = rng.integers(0, 16, (2, 60)) / 2 if exact else rng.uniform(0, 8, (2, 60))
        x, y = rng.permutation(np.unique(np.stack([x, y]), axis=1), axis=1)  # no two in one place
        if outside:
            lx, ly = box or (8.0, 8.0)
            x, y = x + lx * rng.integers(-3, 4, x.size), y - 1e6 * ly * rng.integers(-3, 4, y.size)
        radius = 0.5 if radii == "one" else rng.choice([0.25, 0.75], x.size)
        i, j = all_pairs(x.size)
        touch = which_touch(i, j, x, y, radius, box)
        assert set(zip(i[touch].tolist(), j[touch].tolist(), strict=True)) == found(x, y, radius, box)
        if not (outside and box is None):
            assert 10 < touch.sum() < 0.2 * touch.size
        if exact and not outside:
            r = np.broadcast_to(radius, x.shape)
            assert np.sum((x[i] - x[j]) ** 2 + (y[i] - y[j]) ** 2 == (r[i] + r[j]) ** 2) >= 10


@pytest.mark.parametrize("box", [None, (4.0, 3.0)])
@sizes(usual=300, campaign=5000)
def test_next_to_a_graze_it_is_what_find_contacts_finds(box, size):
    """Radii that add up to the distance as it is rounded, and to the numbers next to it."""
    rng = np.random.default_rng(4)
    results = set()
    for _ in range(size):
        x, y = rng.uniform(0, 0.9, (2, 2)) + (rng.integers(0, 2, (2, 2)) * np.reshape(box, (2, 1)) if box else 0.0)
        d = np.hypot(
            *(
                (c[1] - c[0]) - (s * np.rint((c[1] - c[0]) / s) if s else 0)
                for c, s in zip((x, y), box or (0, 0), strict=True)
            )
        )
        for ulps in (-1, 0, 1):
            r = d * rng.uniform(0.45, 0.55)
            radius = np.array([r, d - r + ulps * np.spacing(d)])
            (touch,) = which_touch(np.array([0]), np.array([1]), x, y, radius, box)
            assert touch == bool(found(x, y, radius, box))
            results.add((ulps, bool(touch)))
    assert results >= {(-1, False), (0, False), (0, True), (1, True)}


@pytest.mark.parametrize("box", [None, (30.0, 30.0)])
@pytest.mark.parametrize("radii", ["one", "each"])
def test_a_list_with_a_margin_serves_until_a_ball_has_moved_half_of_it(box, radii):
    rng = np.random.default_rng(5)
    n, margin, dt = 150, 1.0, 0.05
    x, y = rng.uniform(0, 30, (2, n))
    vx, vy = rng.normal(size=(2, n))
    radius = 0.8 if radii == "one" else rng.uniform(0.2, 1.2, n)
    x0 = y0 = np.inf
    lists = used = 0
    for _ in range(100):
        x, y = x + dt * vx, y + dt * vy
        if 2.0 * np.hypot(x - x0, y - y0).max() > margin:
            i, j = collide.find_contacts(x, y, radius, box=box, margin=margin)
            x0, y0, lists = x, y, lists + 1
        touch = which_touch(i, j, x, y, radius, box)
        assert set(zip(i[touch].tolist(), j[touch].tolist(), strict=True)) == found(x, y, radius, box)
        used += touch.sum() < i.size
        collide.resolve_contacts(i, j, 1.0, x, y, vx, vy, radius=radius, box=box)
    assert 3 < lists < 50 < used


@pytest.mark.parametrize("box", [None, (10.0, 7.0)])
@pytest.mark.parametrize("radii", ["one", "each"])
@pytest.mark.parametrize("dtype", [np.float64, np.float32])
@pytest.mark.parametrize("layout", ["columns", "rows"])
def test_with_radii_each_pair_sees_what_the_earlier_ones_left(box, radii, dtype, layout):
    rng = np.random.default_rng(6)
    (x, y), v, m = state(200, rng)
    v = v.astype(dtype)
    radius = 0.9 if radii == "one" else rng.uniform(0.3, 1.5, 200)
    i, j = rng.permutation(all_pairs(200), axis=1)
    touch = which_touch(i, j, x, y, radius, box)
    want_x, want_y, impulses, resolved = in_order(i[touch], j[touch], m, x, y, *v, 0.8, box)
    want = np.zeros(i.size)
    want[touch] = impulses
    u, impulse = (np.ascontiguousarray(v.T).T if layout == "rows" else v.copy()), np.full(i.size, 9.0)
    options = {"radius": radius, "restitution": 0.8, "box": box, "impulse": impulse}
    assert collide.resolve_contacts(i, j, m, x, y, *u, **options) == resolved > 100
    np.testing.assert_array_equal(u, [want_x, want_y])
    np.testing.assert_array_equal(impulse, want)
    assert want_x.dtype == u.dtype == dtype


@pytest.mark.fast
@pytest.mark.parametrize("reason", BROKEN)
@pytest.mark.parametrize("radius", [0.5, 0.25, [0.5, 0.5, 0.0, 0.5, 0.5]])
def test_a_pair_is_invalid_whether_it_touches_or_not(reason, radius):
    """All stand a unit apart, if anywhere."""
    args, options = broken(BROKEN[reason])
    touch = radius == 0.5
    if "result of the collision" in reason and not touch:
        assert collide.resolve_contacts(*args, **options, radius=radius) == np.sum(np.size(radius) > 1) * 2
        return
    with pytest.raises(collide.InvalidPairError) as info:
        collide.resolve_contacts(*args, **options, radius=radius)
    assert (info.value.index, info.value.count) == ((1,), 1) or reason.startswith("m1 = -1.0")
    assert info.value.reason.partition(": ")[2].startswith(reason.replace("m1 = -1.0", "m2 = -1.0"))


@pytest.mark.fast
@pytest.mark.parametrize("place", [np.nan, INF, -INF])
@pytest.mark.parametrize("box", [None, (10.0, 10.0)])
def test_a_place_that_is_none_is_invalid_and_not_merely_far(place, box):
    for x, y in itertools.product(([0.0, place], [place, 0.0], [place, place]), ([0.0, 1.0], [0.0, place])):
        v = np.array([1.0, 0.0]), np.zeros(2)
        with pytest.raises(collide.InvalidPairError, match=r"n[xy] = -?(nan|inf): must be finite"):
            collide.resolve_contacts([0], [1], 1.0, x, y, *v, radius=1.0, box=box)
        assert v[0].tolist() == [1.0, 0.0]


@pytest.mark.fast
def test_far_apart_and_immovable():
    v = np.array([1.0, -1.0]), np.zeros(2)
    assert collide.resolve_contacts([0], [1], INF, [0.0, 3.0], [0.0, 0.0], *v, radius=1.0) == 0
    with pytest.raises(collide.InvalidPairError, match="two immovable balls"):
        collide.resolve_contacts([0], [1], INF, [0.0, 2.0], [0.0, 0.0], *v, radius=1.0)
    # Their squared distance is beyond float64, they are not.
    assert collide.resolve_contacts([0], [1], 1.0, [0.0, 1e200], [0.0, 0.0], *v, radius=1.0) == 0


@pytest.mark.fast
def test_float32_that_is_too_large():
    vx, vy = np.array([3e38, -3e38], np.float32), np.zeros(2, np.float32)
    args = [0], [1], [3.0, 1.0], [0.0, 1.0], [0.0, 0.0]
    with pytest.raises(collide.InvalidPairError, match="too large for the dtype of the result"):
        collide.resolve_contacts(*args, vx, vy)
    assert vx.tolist() == [np.float32(3e38), np.float32(-3e38)]
    assert collide.resolve_contacts(*args, vx, vy, invalid="nan") == 0
    assert np.isnan([vx, vy]).all()

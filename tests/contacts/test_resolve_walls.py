"""Balls at the walls of a box, against a loop over the balls that asks the one-pair formula."""

import itertools
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import collide
from tests.helpers.sizes import sizes

INF = np.inf


def one_by_one(x, y, vx, vy, radius, box, m=1.0, restitution=1.0, impulse=(0.0, 0.0, 0.0, 0.0)):
    """The same, ball by ball in plain Python: velocities, impulses on the walls, bounces."""
    n, impulse, bounces = len(x), [float(p) for p in impulse], 0
    after = [np.array(v, np.float64) for v in (vx, vy)]
    radius, m, e = (np.broadcast_to(np.asarray(a, np.float64), n).tolist() for a in (radius, m, restitution))
    places = [np.asarray(a, np.float64).tolist() for a in (x, y)]
    for k, axis in itertools.product(range(n), range(2)):
        place, v, side = places[axis][k], float(after[axis][k]), box[axis]
        if side is None:
            continue
        if v < 0 and place - radius[k] <= 0:  # the wall is ball 1, on the left
            _, after[axis][k] = collide.scalar.resolve_1d(INF, m[k], 0.0, v, e[k])
            impulse[2 * axis] += collide.scalar.impulse_2d(m[k], INF, v, 0.0, 0.0, 0.0, -1.0, 0.0, e[k])
            bounces += 1
        elif v > 0 and place + radius[k] >= side:
            after[axis][k], _ = collide.scalar.resolve_1d(m[k], INF, v, 0.0, e[k])
            impulse[2 * axis + 1] += collide.scalar.impulse_2d(m[k], INF, v, 0.0, 0.0, 0.0, 1.0, 0.0, e[k])
            bounces += 1
    return [u.astype(np.asarray(v).dtype) for u, v in zip(after, (vx, vy), strict=True)], impulse, bounces


def same_bits(a, b):
    np.testing.assert_array_equal(a, b)
    np.testing.assert_array_equal(np.signbit(a), np.signbit(b))


def state(n, rng):
    """Half of the balls near a wall, some of them beyond it, some on it; and the sides of their box."""
    box = 10.0, 7.0
    x, y = (rng.uniform(-0.3, 1.3, n) * side for side in box)
    x[::7], y[::11] = 1.0, 6.0  # with a radius of 1 on the wall
    return x, y, *rng.normal(size=(2, n)), box


LAYOUTS: dict[str, Any] = {
    "columns": np.array,
    "rows": lambda a: np.stack([a, a], axis=1)[:, 1],
    "rows of three": lambda a: np.stack([a, a, a], axis=1)[:, 1],
    "backwards": lambda a: a[::-1].copy()[::-1],
    "subclass": lambda a: np.stack([a, a]).view(type("Sub", (np.ndarray,), {}))[1],
    "records": lambda a: np.rec.fromarrays([np.zeros(len(a), "i1"), a])["f1"],  # misaligned
}


@pytest.mark.parametrize("dtypes", ["dd", "df", "fd", "ff"])
@pytest.mark.parametrize("radius", ["one", "each"])
@pytest.mark.parametrize("layout", LAYOUTS)
def test_each_ball_at_a_wall_collides_with_an_immovable_one(layout, radius, dtypes):
    rng = np.random.default_rng(0)
    for n in (1, 9, 150):  # a ball, a step of lanes and one more, three blocks
        x, y, vx, vy, box = state(n, rng)
        sizes: Any
        sizes, m, e = rng.uniform(0.1, 1.5, n), rng.uniform(0.0, 3.0, n), rng.uniform(0.0, 1.2, n)
        place, velocity = (np.dtype(c) for c in dtypes)
        x, y, each = (LAYOUTS[layout](a.astype(place)) for a in (x, y, sizes))
        vx, vy = (LAYOUTS[layout](a.astype(velocity)) for a in (vx, vy))
        sizes = each if radius == "each" else 1.0
        for options in ({}, {"m": m, "restitution": e}):
            u, impulse = [vx.copy(), vy.copy()], np.arange(4.0)
            u = [LAYOUTS[layout](a) for a in u]
            want, exact, bounces = one_by_one(x, y, *u, sizes, box, **options, impulse=impulse)
            assert collide.resolve_walls(x, y, *u, sizes, box, **options, impulse=impulse) == bounces
            assert n < 150 or bounces > 50
            same_bits(u, want)
            same_bits(impulse, exact)


number = st.floats(-20, 20) | st.sampled_from([0.0, -0.0, 1.0, 4.0, 5e-324, 1e-300, 1e150])


@settings(deadline=None)
@given(
    balls=st.lists(st.tuples(number, number, number, number, st.floats(0, 2), st.floats(0, 1e9), st.floats(0, 2))),
    box=st.tuples(st.sampled_from([None, 4.0, 7.3]), st.sampled_from([None, 4.0, 1e9])),
    start=st.tuples(*[st.floats(-1e9, 1e9)] * 4),
)
def test_any_values(balls, box, start):
    """And again at once: nobody bounces twice, who does not move outwards any more."""
    x, y, vx, vy, radius, m, e = np.array(balls, float).reshape(-1, 7).T.copy()
    impulse = np.array(start)
    want, exact, bounces = one_by_one(x, y, vx, vy, radius, box, m, e, start)
    assert collide.resolve_walls(x, y, vx, vy, radius, box, m=m, restitution=e, impulse=impulse) == bounces
    same_bits((vx, vy), want)
    same_bits(impulse, exact)
    assert collide.resolve_walls(x, y, vx, vy, radius, box) == 0


@pytest.mark.fast
def test_who_bounces():
    """In this order: at a wall, on it, beyond it; along it, at rest, coming back; free; and just not at it."""
    x = np.array([0.5, 1.0, -3.0, 0.5, 0.5, 0.5, 3.0, 1.0 + 2.0**-40])
    vx = np.array([-1.0, -1.0, -1.0, 0.0, -0.0, 1.0, -1.0, -1.0])
    vy = np.array([0.0, 0.0, 0.0, 2.0, 0.0, 0.0, 0.0, 0.0])
    for mirrored in (False, True):
        u = -vx if mirrored else vx.copy()
        assert collide.resolve_walls(8.0 - x if mirrored else x, 0 * x + 4.0, u, vy, 1.0, (8.0, 8.0)) == 3
        same_bits(-u if mirrored else u, [1.0, 1.0, 1.0, *vx[3:]])
    same_bits(vy, [0.0, 0.0, 0.0, 2.0, 0.0, 0.0, 0.0, 0.0])


@pytest.mark.fast
@pytest.mark.parametrize("at", [(0, 0), (0, 1), (1, 0), (1, 1)])
def test_a_corner_is_two_bounces(at):
    x, y = 0.5 + 9.0 * at[0], 0.5 + 19.0 * at[1]
    vx, vy = np.array([2.0 * at[0] - 1.0]), np.array([6.0 * at[1] - 3.0])
    before, impulse = (vx[0], vy[0]), np.zeros(4)
    assert collide.resolve_walls([x], [y], vx, vy, 1.0, (10.0, 20.0), m=2.0, impulse=impulse) == 2
    assert (vx[0], vy[0]) == (-before[0], -before[1])
    want = np.zeros(4)
    want[[at[0], 2 + at[1]]] = 4.0, 12.0
    np.testing.assert_array_equal(impulse, want)


@pytest.mark.fast
@pytest.mark.parametrize(("box", "bounces"), [((9.0, 9.0), 4), ((9.0, None), 2), ((None, 9.0), 2), ((None, None), 0)])
def test_channels(box, bounces):
    x, y = np.array([0.0, 9.0, 4.0, 4.0, 1e308]), np.array([4.0, 4.0, 0.0, 9.0, 4.0])
    v = np.array([[-1.0, 1.0, 0.0, 0.0, 0.0], [0.0, 0.0, -1.0, 1.0, 1.0]])
    u, impulse = v.copy(), np.full(4, 0.5)
    assert collide.resolve_walls(x, y, *u, 1.0, box, impulse=impulse) == bounces
    turned = np.array([box[0] is not None, box[1] is not None])
    np.testing.assert_array_equal(u[:, :4], np.where(turned, -1, 1)[:, None] * v[:, :4])
    np.testing.assert_array_equal(impulse, 0.5 + 2.0 * turned.repeat(2))


@pytest.mark.fast
@pytest.mark.parametrize("n", [1, 3, 8, 9, 70])
def test_a_small_box(n):
    """Lanes that no ball fills are no balls of another size."""
    vx, vy = np.full(n, -1.0), np.full(n, 2.0)
    x = np.full(n, 0.0625)
    assert collide.resolve_walls(x, x + 0.25, vx, vy, np.full(n, 0.0625), (0.5, 0.5)) == n
    assert (vx == 1.0).all()
    assert (vy == 2.0).all()


@pytest.mark.parametrize("radius", [0.1, np.float64(0.1), [0.1, 0.1], np.array([0.1, 0.1])])
def test_what_touches_is_asked_in_float64(radius):
    """The float32 next to 0.1 is above it."""
    x, v = np.full(2, 0.1, np.float32), np.full((2, 2), -1, np.float32)
    assert collide.resolve_walls(x, x, *v, radius, (1.0, 1.0)) == 0
    assert collide.resolve_walls(x, x, *v, np.float32(0.1), (1.0, 1.0)) == 4


@pytest.mark.fast
def test_no_box_has_no_walls():
    vx, vy = -np.ones(2), np.ones(2)
    assert collide.resolve_walls([0.0, 1.0], [0.0, 1.0], vx, vy, 1.0, None) == 0
    assert (vx.tolist(), vy.tolist()) == ([-1.0, -1.0], [1.0, 1.0])


@pytest.mark.fast
def test_a_box_as_narrow_as_a_ball():
    """It touches both walls, and bounces off that which it moves towards."""
    vx, impulse = np.array([1.0, -1.0]), np.zeros(4)
    assert collide.resolve_walls([1.0, 1.0], [5.0, 5.0], vx, np.zeros(2), 1.0, (2.0, 10.0), impulse=impulse) == 2
    assert vx.tolist() == [-1.0, 1.0]
    assert impulse.tolist() == [2.0, 2.0, 0.0, 0.0]


@pytest.mark.fast
@pytest.mark.parametrize("dtype", [np.float64, np.float32])
def test_which_bits(dtype):
    """Those of -v where e = 1, +0 where e = 0; else what one rounding of (1+e) v leaves, not -e v."""
    v = np.random.default_rng(1).uniform(0.5, 2.0, (2, 1000)).astype(dtype)
    v[0] *= -1
    corner = np.zeros(1000), np.full(1000, 5.0)
    for e in (1.0, 0.0, 0.9):
        u = v.copy()
        assert collide.resolve_walls(*corner, *u, 0.0, (5.0, 5.0), restitution=e) == 2000
        want = collide.resolve_2d(1.0, INF, v[1], 0.0, 0.0, 0.0, 1.0, 0.0, restitution=e).u1x
        np.testing.assert_array_equal(u[1], want)
        if e == 1.0:
            same_bits(u, -v)
        elif e == 0.0:
            same_bits(u, np.zeros_like(v))
        else:
            np.testing.assert_allclose(u, -e * v, rtol=2 * np.finfo(dtype).eps)
            assert dtype == np.float32 or (u != -e * v).any()


@sizes(usual=2000, campaign=20_000)
def test_the_impulse_is_the_change_of_momentum_and_energy_is_lost_by_e(size):
    rng = np.random.default_rng(2)
    x, y, vx, vy, box = state(size, rng)
    m, e = rng.uniform(0.5, 2.0, size), 0.7
    u, impulse = np.stack([vx, vy]), np.zeros(4)
    collide.resolve_walls(x, y, *u, 1.0, box, m=m, restitution=e, impulse=impulse)
    gained = (m * (u - (vx, vy))).sum(axis=1)
    np.testing.assert_allclose(gained, [impulse[0] - impulse[1], impulse[2] - impulse[3]], atol=1e-10)
    assert (impulse > size / 20).all()
    turned = u != (vx, vy)
    lost = 0.5 * (m * ((vx**2 + vy**2) - (u * u).sum(axis=0))).sum()
    normal = 0.5 * (m * np.array([vx, vy]) ** 2)[turned].sum()
    assert lost == pytest.approx((1 - e**2) * normal, rel=1e-12)
    elastic = np.stack([vx, vy])
    collide.resolve_walls(x, y, *elastic, 1.0, box)
    np.testing.assert_array_equal(abs(elastic), abs(np.stack([vx, vy])))


def test_a_particle_between_walls_keeps_its_time():
    """On the wall a thousand times: the pressure of one particle is m v^2 / L."""
    x, v, impulse, time_step, steps = np.array([1.0]), np.array([1.0]), np.zeros(4), 0.25, 4_000
    for _ in range(steps):
        collide.resolve_walls(x, np.array([0.5]), v, np.zeros(1), 0.0, (2.0, None), m=3.0, impulse=impulse)
        x += time_step * v
    np.testing.assert_allclose(impulse / (steps * time_step), [1.5, 1.5, 0.0, 0.0], rtol=1e-3)


@pytest.mark.usefixtures("keep_threads")
def test_the_bits_do_not_depend_on_threads():
    rng = np.random.default_rng(3)
    x, y, vx, vy, box = state(300_000, rng)
    found = []
    for threads in (1, 2, 8):
        collide.set_num_threads(threads)
        u, impulse = (vx.copy(), vy.copy()), np.zeros(4)
        collide.resolve_walls(x, y, *u, 1.0, box, m=0.1 + abs(vy), restitution=0.9, impulse=impulse)
        found.append((u[0].tobytes(), u[1].tobytes(), impulse.tobytes()))
    assert found[0] == found[1] == found[2]


@pytest.mark.fast
def test_nobody_is_there():
    none, impulse = np.empty(0), np.arange(4.0)
    assert collide.resolve_walls([], [], none, none.copy(), 1.0, (5.0, 5.0), impulse=impulse) == 0
    assert collide.resolve_walls(none, none, none, none.copy(), none, (5.0, 5.0), m=none, restitution=none) == 0
    narrow = np.empty(0, np.float32)
    assert collide.resolve_walls(none, narrow, narrow, narrow.copy(), 0.5, (None, 5.0)) == 0
    assert impulse.tolist() == [0.0, 1.0, 2.0, 3.0]


def arguments():
    return {
        "x": np.array([0.5, 5.0, 9.5]),
        "y": np.array([0.5, 5.0, 5.0]),
        "vx": np.array([-3.0, 2.0, 1.0]),
        "vy": np.array([-1.0, 0.0, 0.0]),
        "radius": 1.0,
        "box": (10.0, 10.0),
        "impulse": np.full(4, 9.0),
    }


def frozen(n):
    array = np.zeros(n)
    array.flags.writeable = False
    return array


SHARED = np.zeros(8)
BAD = [
    ({"x": [0.5, np.nan, 9.5]}, ValueError, r"x\[1\] = nan: must be finite"),
    ({"y": [0.5, 5.0, INF]}, ValueError, r"y\[2\] = inf: must be finite"),
    ({"vx": np.array([-3.0, 2.0, -INF])}, ValueError, r"vx\[2\] = -inf: must be finite"),
    ({"vy": np.array([np.nan, 2.0, 1.0])}, ValueError, r"vy\[0\] = nan: must be finite"),
    ({"radius": -1.0}, ValueError, r"radius = -1.0: must be >= 0"),
    ({"radius": [1.0, -0.5, 1.0]}, ValueError, r"radius\[1\] = -0.5: must be >= 0"),
    ({"radius": np.array([1.0, 1.0, -0.5])}, ValueError, r"radius\[2\] = -0.5: must be >= 0"),
    ({"radius": INF}, ValueError, r"radius = inf: must be finite"),
    ({"radius": np.array([1.0, np.nan, 1.0])}, ValueError, r"radius\[1\] = nan: must be finite"),
    ({"radius": INF, "box": (None, None)}, ValueError, r"radius = inf: must be finite"),
    ({"m": -1.0}, ValueError, r"m = -1.0: a mass must be >= 0"),
    ({"m": [1.0, np.nan, 1.0]}, ValueError, r"m\[1\] = nan: a mass must be >= 0"),
    ({"m": np.array([1.0, 1.0, -2.0])}, ValueError, r"m\[2\] = -2.0: a mass must be >= 0"),
    ({"m": INF}, ValueError, r"m = inf: an immovable ball cannot bounce, and ball 0 is at a wall"),
    ({"m": np.array([1.0, INF, INF])}, ValueError, r"m\[2\] = inf: an immovable ball cannot bounce, and ball 2"),
    ({"restitution": -0.5}, ValueError, r"restitution = -0.5: must be >= 0"),
    ({"restitution": np.array([1.0, 1.0, INF])}, ValueError, r"restitution\[2\] = inf: must be finite"),
    ({"restitution": np.nan}, ValueError, r"restitution = nan: must be finite"),
    ({"impulse": np.array([0.0, 0.0, np.nan, 0.0])}, ValueError, r"impulse\[2\] = nan: must be finite"),
    ({"box": (1.9, 10.0)}, ValueError, r"box\[0\] = 1.9: must be at least 2.0, the diameter of the largest ball"),
    ({"radius": np.array([1.0, 6.0, 1.0])}, ValueError, r"box\[0\] = 10.0: must be at least 12.0, the diameter"),
    ({"radius": 3.0, "box": (None, 5)}, ValueError, r"box\[1\] = 5.0: must be at least 6.0, the diameter"),
    ({"box": (0.0, 10.0)}, ValueError, r"box\[0\] = 0.0: must be from"),
    ({"box": (10.0, -1)}, ValueError, r"box\[1\] = -1.0: must be from"),
    ({"box": 10.0}, ValueError, r"box = 10.0: must be None or two lengths"),
    ({"box": (1.0, 2.0, 3.0)}, ValueError, r"box = \(1.0, 2.0, 3.0\): must be None or two lengths"),
    ({"box": (10.0, "ten")}, TypeError, "box: the dtype <U32 is not supported"),
    ({"x": 1.0}, ValueError, r"x has shape \(\): must be one-dimensional"),
    ({"y": np.zeros(4)}, ValueError, r"y has shape \(4,\): must have that of x, \(3,\)"),
    ({"x": np.zeros((3, 1))}, ValueError, r"x has shape \(3, 1\): must be one-dimensional"),
    ({"vx": np.zeros(2)}, ValueError, r"vx has shape \(2,\): must have that of x, \(3,\)"),
    ({"radius": [1.0, 1.0]}, ValueError, r"radius has shape \(2,\): must have that of x, \(3,\)"),
    ({"radius": np.empty(0)}, ValueError, r"radius has shape \(0,\): must have that of x, \(3,\)"),
    ({"m": np.ones((3, 1))}, ValueError, r"m has shape \(3, 1\): must have that of x, \(3,\)"),
    ({"restitution": np.ones(4)}, ValueError, r"restitution has shape \(4,\): must have that of x, \(3,\)"),
    ({"vy": [0.0, 0.0, 0.0]}, TypeError, "vy is of type list: must be a NumPy array, as it is written to"),
    ({"vx": np.ma.zeros(3)}, TypeError, "vx is of type MaskedArray: must be a NumPy array"),
    ({"vx": np.zeros(3, int)}, TypeError, "vx has dtype int64: must have float64 or float32"),
    ({"vx": np.zeros(3, ">f8")}, TypeError, "vx has dtype >f8: must have float64 or float32"),
    ({"vy": np.zeros(3, ">f8")}, TypeError, "vy has dtype >f8: must have float64 or float32"),
    ({"vy": np.zeros(3, np.float16)}, TypeError, "vy has dtype float16: must have float64 or float32"),
    ({"vy": np.zeros(3, np.float32)}, TypeError, "vy has dtype float32: must have that of vx, float64"),
    ({"vx": frozen(3)}, ValueError, "vx is read-only"),
    ({"vy": frozen(3)}, ValueError, "vy is read-only"),
    ({"impulse": np.zeros(3)}, ValueError, r"impulse has shape \(3,\): must have that of the walls, \(4,\)"),
    ({"impulse": np.empty(0)}, ValueError, r"impulse has shape \(0,\): must have that of the walls, \(4,\)"),
    ({"impulse": np.zeros((2, 2))}, ValueError, r"impulse has shape \(2, 2\): must have that of the walls, \(4,\)"),
    ({"impulse": np.zeros(4, np.float32)}, TypeError, "impulse has dtype float32: must have float64"),
    ({"impulse": np.zeros(4, ">f8")}, TypeError, "impulse has dtype >f8: must have float64"),
    ({"impulse": [0.0] * 4}, TypeError, "impulse is of type list: must be a NumPy array"),
    ({"impulse": frozen(4)}, ValueError, "impulse is read-only"),
    ({"vx": SHARED[:3], "vy": SHARED[2:5]}, ValueError, "vx and vy share memory"),
    ({"vy": SHARED[:3], "impulse": SHARED[2:6]}, ValueError, "vy and impulse share memory"),
    ({"x": "left"}, TypeError, "x: the dtype <U4 is not supported"),
    ({"m": [1j, 1, 1]}, TypeError, "m: the dtype complex128 is not supported"),
    ({"radius": None}, TypeError, "radius: the dtype object is not supported"),
]


@pytest.mark.fast
@pytest.mark.parametrize(("change", "error", "message"), BAD, ids=[message for _, _, message in BAD])
def test_bad_input_is_refused_before_anything_is_written(change, error, message):
    given = arguments() | change
    before = {name: np.array(given[name]) for name in ("vx", "vy", "impulse")}
    with pytest.raises(error, match=f"^{message}"):
        collide.resolve_walls(**given)
    for name, old in before.items():
        np.testing.assert_array_equal(given[name], old)


@pytest.mark.fast
@pytest.mark.parametrize(
    ("change", "dtype"),
    [
        ({"vx": [-3.0, 2.0, 1.7e308], "restitution": 3.0}, np.float64),
        ({"vx": [-3.0, 2.0, 3e38], "restitution": 1.5}, np.float32),
        ({"vx": [-3.0, 2.0, 1e200], "m": 1e200}, np.float64),  # the impulse
        ({"vx": [-3.0, 2.0, 1e307], "impulse": [0.0, 1.79e308, 0.0, 0.0]}, np.float64),  # the sum of the impulses
    ],
)
def test_a_bounce_that_is_too_large(change, dtype):
    given = arguments() | {name: np.array(value) for name, value in change.items()}
    given["vx"], given["vy"] = given["vx"].astype(dtype), given["vy"].astype(dtype)
    before = {name: given[name].copy() for name in ("vx", "vy", "impulse")}
    with pytest.raises(ValueError, match=rf"^vx\[2\] = \S+, vy\[2\] = 0.0: .* too large for {np.dtype(dtype)}"):
        collide.resolve_walls(**given)
    for name, old in before.items():
        np.testing.assert_array_equal(given[name], old)
    if "m" in change:  # nobody asks for the impulse
        assert collide.resolve_walls(**given | {"impulse": None}) == 3


@pytest.mark.fast
def test_an_immovable_ball_may_be_where_it_need_not_bounce():
    given = arguments() | {"m": np.array([1.0, INF, 1.0])}
    assert collide.resolve_walls(**given) == 3
    assert given["impulse"].tolist() == [15.0, 11.0, 11.0, 9.0]


@pytest.mark.fast
def test_a_state_in_one_table():
    """One row a ball: nothing is contiguous, and the columns lie between each other."""
    rng = np.random.default_rng(4)
    x, y, vx, vy, box = state(50, rng)
    radius, m, e = rng.uniform(0.0, 2.0, (3, 50))
    want, exact, bounces = one_by_one(x, y, vx, vy, radius, box, m, e)
    table, impulses = np.stack([x, y, vx, vy, radius, m, e], axis=1), np.zeros((4, 2))
    given = dict(zip(("x", "y", "vx", "vy", "radius", "m", "restitution"), table.T, strict=True))
    assert collide.resolve_walls(**given, box=box, impulse=impulses[:, 1]) == bounces
    same_bits(table.T, [x, y, *want, radius, m, e])
    same_bits(impulses.T, [np.zeros(4), exact])


@pytest.mark.parametrize("name", ["x", "y", "radius", "m", "restitution"])
@pytest.mark.parametrize("output", ["vx", "vy", "impulse"])
@pytest.mark.parametrize("shift", [0, 1])
def test_inputs_that_share_memory_with_outputs_count_as_they_were(name, output, shift):
    rng = np.random.default_rng(5)
    n = 4 if output == "impulse" else 100
    memory = rng.uniform(0.1, 2.0, n + shift)
    x, y, vx, vy, box = state(n, rng)
    given = {"x": x, "y": y, "vx": -abs(vx), "vy": abs(vy), "radius": 1.0, "box": box, "impulse": np.zeros(4)}
    given |= {output: memory[:n], name: memory[shift:]}
    apart = {key: value.copy() if isinstance(value, np.ndarray) else value for key, value in given.items()}
    want, exact, bounces = one_by_one(**apart)
    assert collide.resolve_walls(**given) == bounces > 0
    same_bits((given["vx"], given["vy"]), want)
    same_bits(given["impulse"], exact)

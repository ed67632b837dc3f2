"""The search for contacts against every pair tried, wherever a grid could go wrong."""

import itertools
import threading
import tracemalloc

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import collide
from collide._contacts import at_once as _at_once
from collide._contacts import grid as _grid
from collide._contacts import layout
from collide._contacts import search as _search
from collide._contacts import state as _state
from collide._system import memory
from tests.helpers import naive
from tests.helpers.sizes import sizes


def check(x, y, radius, **options):
    """The contacts, if they are those of the oracle, each once, in both ways: at once, and as those of many balls."""
    want = naive.find_contacts(x, y, radius, **options)
    for most in (0, _at_once.MOST):
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(_at_once, "MOST", most)
            i, j = collide.find_contacts(x, y, radius, **options)
        assert i.dtype == j.dtype == np.intp
        assert (i < j).all()
        order = np.lexsort((j, i))
        np.testing.assert_array_equal(np.stack([i, j], axis=1)[order], want)
    return i, j


def scatter(n, packing, rng, radius=1.0, aspect=1.0):
    """n balls strewn over a rectangle, and its sides."""
    area = np.pi * np.sum(np.broadcast_to(radius, n) ** 2) / packing
    sides = np.sqrt(area * aspect), np.sqrt(area / aspect)
    return rng.uniform(0, sides[0], n), rng.uniform(0, sides[1], n), sides


# Which axes are periodic.
SPACES = {"open": (False, False), "a box": (True, True), "along x": (True, False), "along y": (False, True)}
in_every_space = pytest.mark.parametrize("space", SPACES)


def box_of(space, sides):
    return tuple(side if periodic else None for side, periodic in zip(sides, SPACES[space], strict=True))


RADII = {
    "equal": lambda n, rng: 1.0,
    "nearly equal": lambda n, rng: rng.uniform(0.9, 1.1, n),
    "1 to 20": lambda n, rng: np.where(rng.random(n) < 0.01, 1.0, 0.05),
    "a million times": lambda n, rng: 10.0 ** rng.uniform(-6, 0, n),
    "more than there are grids": lambda n, rng: 10.0 ** rng.uniform(-40, 0, n),
    "points among balls": lambda n, rng: np.where(rng.random(n) < 0.5, 0.0, 0.3),
}


@in_every_space
@pytest.mark.parametrize("packing", [0.003, 0.4, 1.5])
@pytest.mark.parametrize(
    ("n", "aspect"),
    [(2, 1.0), (40, 1.0), (500, 1.0), (700, 30.0), pytest.param(1500, 1.0, marks=pytest.mark.campaign)],
)
def test_against_every_pair(n, aspect, packing, space, subtests):
    for radii, margin in itertools.product(RADII, (0.0, 0.07)):
        rng = np.random.default_rng(n)
        radius = RADII[radii](n, rng)
        x, y, box = scatter(n, packing, rng, radius, aspect)
        x, y = x - 0.3 * box[0], y + 0.4 * box[1]  # a part of them outside the box
        reach = 2 * np.max(radius) + margin
        box = box_of(space, [max(side, 2 * reach, 1.0) for side in box])
        with subtests.test(radii=radii, margin=margin):
            check(x, y, radius, margin=margin, box=box)


def test_boxes_of_few_cells_list_no_pair_twice(subtests):
    rng = np.random.default_rng(1)
    x, y = rng.uniform(-5, 5, (2, 150))
    for box in itertools.product([2.0, 2.5, 3.0, 3.01, 3.99, 4.0, 4.01, 5.5, None], [2.0, 3.0, 4.01, 17.0, None]):
        with subtests.test(box=box):
            i, j = check(x, y, 0.5, box=box)
            assert len(set(zip(i.tolist(), j.tolist(), strict=True))) == i.size > 0


@pytest.mark.fast
@pytest.mark.parametrize("offset", [0.0, 1e6, 2.0**40, 2.0**51, -(2.0**50)])
def test_balls_that_just_touch(offset):
    x, y = (c.ravel() + offset for c in np.meshgrid(np.arange(25.0), np.arange(30.0)))
    i, _ = check(x, y, 0.5)
    assert i.size == 24 * 30 + 25 * 29
    i, _ = check(x, y, np.nextafter(0.5, 0))
    assert i.size == 0
    for box, count in (
        ((25.0, 30.0), 2 * 25 * 30),
        ((25.0, None), 25 * 30 + 25 * 29),
        ((None, 30.0), 24 * 30 + 25 * 30),
    ):
        near = [c - offset if side else c for c, side in zip((x, y), box, strict=True)]
        i, _ = check(*near, 0.5, box=box)
        assert i.size == count


@settings(max_examples=300, deadline=None)
@given(
    st.lists(st.tuples(st.integers(-40, 40), st.integers(-40, 40), st.integers(0, 12)), min_size=2, max_size=60),
    st.sampled_from([1.0, 0.1, 1 / 3, 1e-160, 1e140]),
    st.integers(0, 3),
    st.tuples(st.none() | st.integers(54, 90), st.none() | st.integers(54, 200)),
)
def test_lattices_of_any_scale(balls, unit, margin, box):
    # On a lattice balls are often at exactly the distance that counts.
    x, y, radius = unit * np.array(balls, float).T
    margin = margin * unit
    least = 2 * (2 * radius.max() + margin)  # which 54 units may fall short of by a rounding
    if not (54 * unit >= 1e-150 and 200 * unit <= 1e150):
        box = None, None
    check(x, y, radius, margin=margin, box=tuple(side and max(least, side * unit) for side in box))


@settings(max_examples=200, deadline=None)
@given(st.lists(st.tuples(*[st.floats(allow_nan=False, allow_infinity=False)] * 2), min_size=2, max_size=40), st.data())
def test_positions_of_any_size(points, data):
    x, y = np.array(points).T
    radius = data.draw(st.sampled_from([0.0, 1e-170, 1e-160, 1.0, 1e149]))
    check(x, y, radius)
    check(np.append(x, x[0]), np.append(y, y[0]), radius)
    side = data.draw(st.sampled_from([4 * radius, 1e3, 1e150]))
    if max(1e-150, 4 * radius) <= side:
        for space in SPACES:
            check(x, y, radius, box=box_of(space, (side, side)))


@pytest.mark.parametrize("far", [1e4, 1e9, 1e16, 1e30, 1e300])
@pytest.mark.parametrize("axis", [0, 1])
@sizes(usual=20_000, campaign=100_000)
def test_a_ball_in_the_far_distance(far, axis, size):
    rng = np.random.default_rng(2)
    n = size
    x, y, sides = scatter(n, 0.4, rng)
    for channel in (False, True):
        box = tuple(side if channel and k != axis else None for k, side in enumerate(sides))
        moved = [x, y]
        near = collide.find_contacts(*moved, 1.0, box=box)
        moved[axis] = moved[axis].copy()
        moved[axis][0] = far
        i, j = peak_of(*moved, box=box)
        keep = (near.i != 0) & (near.j != 0)
        assert sorted(zip(i, j, strict=True)) == sorted(zip(near.i[keep], near.j[keep], strict=True))


def peak_of(x, y, box=None):
    """The contacts of balls of radius 1, if they take up to 100 bytes a ball beyond themselves."""
    kept = collide.get_spare_memory()
    collide.set_spare_memory(0)
    tracemalloc.start()
    i, j = collide.find_contacts(x, y, 1.0, box=box)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    collide.set_spare_memory(kept)
    assert peak <= 100 * x.size + i.nbytes + j.nbytes
    return i, j


@pytest.mark.parametrize("n", [200_000, _at_once.MOST])
@pytest.mark.parametrize("packing", [1e-6, 0.1, 0.2, 0.4, 2.0])
def test_memory(packing, n):
    x, y, _ = scatter(n, packing, np.random.default_rng(3))
    collide.find_contacts(x, y, 1.0)  # the process's first call loads the kernels too, which takes 17 MB
    peak_of(x, y)
    peak_of(x, y)


@pytest.mark.fast
def test_clusters_far_apart():
    rng = np.random.default_rng(4)
    x, y = rng.uniform(0, 50, (2, 1200))
    x[:600] += 1e12
    y[300:900] -= 1e7
    for box in ((None, None), (None, 60.0), (60.0, None)):
        assert check(x, y, 0.5, box=box)[0].size > 100


@in_every_space
def test_a_box_counts_on_the_axes_that_it_has(space):
    """What is nearer through the box than in open space is all that the box adds, axis by axis."""
    rng = np.random.default_rng(11)
    x, y, sides = scatter(3000, 0.4, rng)
    found = {*zip(*map(np.ndarray.tolist, collide.find_contacts(x, y, 1.0, box=box_of(space, sides))), strict=True)}
    whole = collide.find_contacts(x, y, 1.0, box=sides)
    through = [abs(c[whole.i] - c[whole.j]) > side / 2 for c, side in zip((x, y), sides, strict=True)]
    for axis, periodic in enumerate(SPACES[space]):
        assert through[axis].any()
        through[axis] &= not periodic
    stay = ~(through[0] | through[1])
    assert found == {*zip(whole.i[stay].tolist(), whole.j[stay].tolist(), strict=True)}
    if space == "open":
        np.testing.assert_array_equal(
            collide.find_contacts(x, y, 1.0), collide.find_contacts(x, y, 1.0, box=[None] * 2)
        )


@sizes(usual=1000, campaign=3000)
def test_all_in_one_place(size, monkeypatch):
    n = size
    i, j = collide.find_contacts(np.full(n, 0.1), np.full(n, -7.0), 1e-3)
    assert i.size == n * (n - 1) // 2
    np.testing.assert_array_equal(np.unique(i * n + j), np.flatnonzero(np.triu(np.ones((n, n)), 1)))
    assert collide.find_contacts(np.zeros(n), np.zeros(n), 0.0).i.size == i.size
    monkeypatch.setattr(memory, "installed", lambda: 160_000)
    with pytest.raises(MemoryError, match="more than 10,000 contacts: there is no memory for a list of them"):
        collide.find_contacts(np.zeros(n), np.zeros(n), 1.0)


def test_no_more_contacts_than_there_is_memory_for(monkeypatch):
    n = 40_000  # shares for several threads, none of which has too many alone
    x, y, _ = scatter(n, 0.5, np.random.default_rng(8))
    monkeypatch.setattr(_search, "_MANY", 1000)
    monkeypatch.setattr(memory, "free", lambda: 16 * 30_000)
    with pytest.raises(MemoryError, match=r"^\d\d,\d\d\d contacts: there is no memory for a list of them"):
        collide.find_contacts(x, y, 1.0)
    monkeypatch.setattr(memory, "free", lambda: 16 * 90_000)
    assert 30_000 < collide.find_contacts(x, y, 1.0).i.size < 90_000


@in_every_space
@pytest.mark.parametrize("packing", [1e-3, 0.4])
def test_few_balls_are_searched_at_once_and_listed_in_the_same_order(packing, space, monkeypatch):
    x, y, box = scatter(_at_once.MOST, packing, np.random.default_rng(12))
    kernels = "ARRANGE", "LIST", "PLACE", "SEARCH", "SPREAD"
    with monkeypatch.context() as patch:
        for name in kernels:
            patch.delattr(_search, name)
        short = [collide.find_contacts(x[:n], y[:n], 1.0, box=box_of(space, box)) for n in (2, 100, x.size)]
    monkeypatch.delattr(_at_once._AT_ONCE, "compiled")
    monkeypatch.setattr(_at_once, "MOST", x.size - 1)
    np.testing.assert_array_equal(short[-1], collide.find_contacts(x, y, 1.0, box=box_of(space, box)))
    assert short[-1].i.size > 10
    apart = abs(np.diff(x[short[-1].i])) + abs(np.diff(y[short[-1].i]))
    assert packing < 0.1 or np.median(apart) < 10  # neighbours in space are near each other in the list


def test_more_contacts_than_there_is_room_for():
    """As few balls as may be, and as many contacts: those before the room ends, at it and beyond."""
    rng = np.random.default_rng(13)
    for n in (*range(2, 30), 100, 500):
        for packing in (1.0, 2.0, 3.0):
            x, y, _ = scatter(n, packing, rng)
            check(x, y, 1.0)
        check(np.zeros(n), np.zeros(n), 1.0)
    for crowd in range(17, 40):  # in one place, and others apart: the room, 4 n + 64, ends with the last contact
        n = -(-(crowd * (crowd - 1) // 2 - 64) // 4)
        x = 9.0 * np.maximum(0, np.arange(n) - crowd + 1)
        assert 0 <= 4 * n + 64 - check(x, 0 * x, 1.0)[0].size < 4


@in_every_space
def test_specks_by_the_hundred_in_a_cell_of_large_balls(space):
    """One grid for all sizes will not do then, though there are slots enough: some are crowded, most are empty."""
    rng = np.random.default_rng(15)
    x, y, sides = scatter(3000, 0.01, rng)
    x[:1500], y[:1500], radius = x[:1500] / 500, y[:1500] / 500, np.where(np.arange(3000) < 1500, 1e-4, 1.0)
    box = box_of(space, sides)
    bounds = [_state.bounds("", a) for a in (x, y, radius)]
    lengths = _state.sides(box)
    assert _at_once.contacts(x, y, radius, bounds, lengths, 0.0) is None
    assert _at_once.contacts(x[1500:], y[1500:], radius[1500:], bounds, lengths, 0.0) is not None
    check(x, y, radius, box=box)


def test_one_radius_for_all_is_one_level():
    for size in (0.0, 1.0):
        common = np.array([(size, 0.0, 0.0, 0.0)], _grid.COMMON)
        assert len(layout.levels_of(np.full(1, size), size, common, 10**6)) == 1


def test_distances_whose_squares_underflow():
    # 0 <= 0 in float64, as written.
    assert check([0.0, 2.0**-538], [0.0, 0.0], 1e-170)[0].size == 1
    assert check([0.0, 2.0**-530], [0.0, 0.0], 1e-170)[0].size == 0


@pytest.mark.usefixtures("keep_threads")
@in_every_space
def test_the_list_is_the_same_on_any_number_of_threads(space):
    rng = np.random.default_rng(5)
    n = 120_000
    radius = np.where(rng.random(n) < 0.005, 1.0, rng.uniform(0.04, 0.1, n))
    x, y, box = scatter(n, 0.5, rng, radius)
    lists = []
    for threads in (1, 2, 3, 8):
        collide.set_num_threads(threads)
        lists.append(collide.find_contacts(x, y, radius, box=box_of(space, box)))
    for other in lists[1:]:
        np.testing.assert_array_equal(np.stack(lists[0]), np.stack(other))
    assert lists[0].i.size > n // 2


def test_threads_at_once():
    rng = np.random.default_rng(6)
    states = [scatter(20_000 + 999 * k, 0.5, rng)[:2] for k in range(4)]
    alone = [collide.find_contacts(x, y, 1.0) for x, y in states]
    together: list[list[collide.contacts.Contacts]] = [[] for _ in states]

    def work(k):
        together[k] = [collide.find_contacts(*states[k], 1.0) for _ in range(10)]

    threads = [threading.Thread(target=work, args=(k,)) for k in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    for one, several in zip(alone, together, strict=True):
        assert len(several) == 10
        for contacts in several:
            np.testing.assert_array_equal(np.stack(one), np.stack(contacts))


@pytest.mark.fast
def test_inputs_of_all_kinds():
    x, y, want = np.array([0, 1, 5, 6]), np.array([0, 1, 0, 1]), [[0, 2], [1, 3]]
    frozen = x.astype(np.float64)
    frozen.flags.writeable = False
    for xs in (x, x.tolist(), tuple(x), x.astype(np.float32), x.astype(">f8"), np.repeat(x, 2)[::2] * 1.0, frozen):
        np.testing.assert_array_equal(collide.find_contacts(xs, y, np.float32(0.75)), want)
    np.testing.assert_array_equal(collide.find_contacts(x, y, [0.75]), want)
    np.testing.assert_array_equal(collide.find_contacts(x, y, [0.75] * 4, margin=np.float64(0)), want)
    np.testing.assert_array_equal(collide.find_contacts(x, y, 0, margin=1.5), want)
    np.testing.assert_array_equal(collide.find_contacts(x, y, 0.75, box=np.array([50, 50])), want)
    np.testing.assert_array_equal(frozen, x)


@pytest.mark.parametrize("box", [None, (9.0, 9.0), (None, 9.0)])
def test_none_or_one(box):
    for n in (0, 1):
        i, j = collide.find_contacts(np.zeros(n), np.zeros(n), np.ones(n), box=box)
        assert i.size == j.size == 0
        assert i.dtype == j.dtype == np.intp
    assert collide.find_contacts([], [], 1.0, box=box).i.size == 0


def test_the_least_and_the_largest_wherever_they_are():
    rng = np.random.default_rng(14)
    assert _state.bounds("x", np.empty(0)) == (0.0, 0.0)
    assert _state.bounds("x", np.arange(9, dtype=np.float32)[::-2]) == (0.0, 8.0)
    for n in (*range(1, 14), 1000):
        a = rng.normal(size=n)
        for k in range(n):
            for value in (-9.0, 9.0, -1.7e308, 0.0):
                b = a.copy()
                b[k] = value
                assert _state.bounds("x", b) == (b.min(), b.max())
            for value in (np.nan, np.inf, -np.inf):
                b[k] = value
                with pytest.raises(ValueError, match=rf"^x(\[{k}\])? = {value}: must be finite"):
                    _state.bounds("x", b)


@pytest.mark.fast
@pytest.mark.parametrize(
    ("change", "error", "message"),
    [
        ({"x": [0.0, np.nan, 1.0]}, ValueError, r"x\[1\] = nan: must be finite"),
        ({"y": [0.0, 1.0, -np.inf]}, ValueError, r"y\[2\] = -inf: must be finite"),
        ({"radius": [1.0, 1.0, -0.5]}, ValueError, r"radius\[2\] = -0.5: must be >= 0"),
        ({"radius": -1.0}, ValueError, r"radius = -1.0: must be >= 0"),
        ({"radius": np.inf}, ValueError, r"radius = inf: must be finite"),
        ({"radius": [1.0, np.nan, 1.0]}, ValueError, r"radius\[1\] = nan: must be finite"),
        ({"radius": 1e151}, ValueError, r"2 radius \+ margin = 2e\+151 for the largest ball: must be at most 1e\+150"),
        ({"y": [0.0, 1.0]}, ValueError, r"y has shape \(2,\): must have that of x, \(3,\)"),
        ({"x": 1.0}, ValueError, r"x has shape \(\): must be one-dimensional"),
        ({"x": [[0.0, 1.0, 2.0]]}, ValueError, r"x has shape \(1, 3\): must be one-dimensional"),
        ({"radius": [1.0, 1.0]}, ValueError, r"radius has shape \(2,\): must have that of x, \(3,\)"),
        ({"margin": -0.1}, ValueError, r"margin = -0.1: must be one finite number >= 0"),
        ({"margin": np.nan}, ValueError, r"margin = nan: must be one finite number >= 0"),
        ({"margin": [0.1, 0.2]}, ValueError, r"margin = \[0.1, 0.2\]: must be one finite number >= 0"),
        ({"margin": "wide"}, TypeError, r"margin: the dtype <U4 is not supported"),
        ({"box": (None, 3.9)}, ValueError, r"box\[1\] = 3.9: must be at least 4.0, twice as far as balls touch"),
        ({"box": (4.0, 3.9)}, ValueError, r"box\[1\] = 3.9: must be at least 4.0, twice as far as balls touch"),
        ({"box": (4.0, 4.0), "margin": 1.0}, ValueError, r"box\[0\] = 4.0: must be at least 6.0"),
        ({"box": (0.0, 9.0)}, ValueError, r"box\[0\] = 0.0: must be from 1e-150 to 1e\+150"),
        ({"box": (1e-151, 9.0), "radius": 0.0}, ValueError, r"box\[0\] = 1e-151: must be from 1e-150 to 1e\+150"),
        ({"box": (1e151, 9.0)}, ValueError, r"box\[0\] = 1e\+151: must be from"),
        ({"box": (9.0, np.nan)}, ValueError, r"box\[1\] = nan: must be from"),
        ({"box": (9.0, -9.0)}, ValueError, r"box\[1\] = -9.0: must be from"),
        ({"box": (None, -9.0)}, ValueError, r"box\[1\] = -9.0: must be from"),
        ({"box": (0, None)}, ValueError, r"box\[0\] = 0.0: must be from"),
        ({"box": (None, "wide")}, TypeError, r"box: the dtype <U32 is not supported"),
        ({"box": (None, [9.0])}, TypeError, r"box = .*: must be an array of numbers"),
        ({"box": (None,)}, ValueError, r"box = \(None,\): must be None or two lengths"),
        ({"box": np.full((2, 2), 9.0)}, ValueError, r"(?s)box = array.*: must be None or two lengths"),
        ({"box": 9.0}, ValueError, r"box = 9.0: must be None or two lengths, \(Lx, Ly\)"),
        ({"box": (9.0, 9.0, 9.0)}, ValueError, r"box = \(9.0, 9.0, 9.0\): must be None or two lengths"),
        ({"x": ["a", "b", "c"]}, TypeError, r"x: the dtype <U1 is not supported"),
        ({"y": np.ma.array([0.0, 1.0, 2.0])}, TypeError, "y: masked arrays are not supported"),
        ({"radius": 1j}, TypeError, "radius: the dtype complex128 is not supported"),
    ],
)
def test_bad_input(change, error, message):
    arguments = {"x": [0.0, 1.0, 2.0], "y": [0.0, 1.0, 2.0], "radius": 1.0} | change
    with pytest.raises(error, match=message):
        collide.find_contacts(**arguments)


def test_blocks_and_chunks_fit_the_shares():
    # Kernels take whole blocks, chunks and buckets: what a share begins with is a multiple of each.
    assert _grid.CHUNK % _grid.BLOCK == 0
    rng = np.random.default_rng(7)
    for n in (_grid.CHUNK - 1, _grid.CHUNK, _grid.CHUNK + 1, 3 * _grid.CHUNK + 65):
        x, y, _ = scatter(n, 0.3, rng)
        i, j = collide.find_contacts(x, y, 1.0)
        assert ((x[i] - x[j]) ** 2 + (y[i] - y[j]) ** 2 <= 4.0).all()
        assert i.size == np.unique(i * n + j).size
        assert abs(i.size / (2 * 0.3 * n) - 1) < 0.1


# The cost, without a clock: how many others share a ball's cell, and how many cells larger balls look at.

LINE = np.arange(20_000) * 2.1
HALF = np.arange(20_000) % 2 == 0


def strewn(radius, packing, seed=10):
    rng = np.random.default_rng(seed)
    radius = radius(20_000, rng) if callable(radius) else radius
    x, y, box = scatter(20_000, packing, rng, radius)
    return x, y, radius, box


TRAPS = {
    "a gas": lambda: strewn(1.0, 0.4),
    "a thin gas": lambda: strewn(1.0, 1e-4),
    "a row": lambda: (LINE, 0 * LINE, 1.0, (LINE[-1] + 9, LINE[-1] + 9)),
    "a column": lambda: (0 * LINE, LINE, 1.0, (LINE[-1] + 9, LINE[-1] + 9)),
    "a diagonal": lambda: (LINE, LINE, 1.0, (LINE[-1] + 9, LINE[-1] + 9)),
    "another diagonal": lambda: (LINE, -LINE, 1.0, (LINE[-1] + 9, LINE[-1] + 9)),
    "two walls far apart": lambda: (LINE, np.where(HALF, 0.0, 1e7), 1.0, (LINE[-1] + 9, 3e7)),
    "a row and one ball far away": lambda: (LINE, np.where(LINE == 0, 1e7, 0.0), 1.0, (LINE[-1] + 9, 3e7)),
    "a lattice as wide as a torus": lambda: (LINE % 300 // 2.1 * 128.2, LINE // 300 * 128.2, 1.0, (2e4, 2e4)),
    "points among balls": lambda: strewn(np.where(HALF, 1.0, 0.0), 0.4),
    "specks among balls": lambda: strewn(np.where(HALF, 1.0, 1e-3), 0.4),
    "few balls among specks": lambda: strewn(np.where(np.arange(20_000) % 100 == 0, 1.0, 1e-3), 0.1),
    "sizes over six decades": lambda: strewn(RADII["a million times"], 0.4),
    "sizes 1 to 20": lambda: strewn(RADII["1 to 20"], 0.4),
    # So far out in cells that their numbers are multiples of a power of two, as the number of balls is.
    "whole numbers": lambda: (*np.random.default_rng(11).integers(0, 1000, (2, 1 << 14)) * 1.0, 1e-12, (1024, 1024)),
    "points of few bits": lambda: (*np.random.default_rng(12).random((2, 1 << 15), np.float32) * 1e3, 0.0, (1e3, 1e3)),
    "points of few digits": lambda: (
        *np.random.default_rng(12).random((2, 20_000), "f4") * np.float64(1e3),
        0.0,
        (1e3, 1e3),
    ),
}


@in_every_space
@pytest.mark.parametrize("trap", TRAPS)
def test_nothing_makes_it_quadratic(trap, space, monkeypatch):
    x, y, radius, box = TRAPS[trap]()
    seen = []

    class Search:
        @property
        def compiled(self):
            return lambda *arguments: seen.append(arguments) or _grid.SEARCH.compiled(*arguments)

    monkeypatch.setattr(_search, "SEARCH", Search())
    monkeypatch.setattr(_at_once, "MOST", 0)
    collide.find_contacts(x, y, radius, box=box_of(space, box))
    _, _, _, _, _, ends, grids, *_ = seen[0]
    slots = [*grids["slot"], ends.size - 1]
    balls = np.diff(ends[slots])
    assert balls.sum() == x.size
    assert (np.diff(ends).astype(float) ** 2).sum() / x.size < 40
    looked_at = 0.0
    for g, coarse in enumerate(grids):
        for h in range(g + 1, len(grids)):
            reach = coarse["radius"] + grids["radius"][h]
            cells = (2 * reach * grids["per_x"][h] + 2) * (2 * reach * grids["per_y"][h] + 2)
            looked_at += balls[g] * min(cells, slots[h + 1] - slots[h])
    assert looked_at / x.size < 40


@in_every_space
@pytest.mark.parametrize("trap", TRAPS)
def test_nothing_makes_it_quadratic_at_once(trap, space, monkeypatch):
    x, y, radius, box = TRAPS[trap]()
    taken = []

    class Search:
        @property
        def compiled(self):
            return lambda *arguments: taken.append((arguments, kernel(*arguments))) or taken[0][1]

    kernel = _at_once._AT_ONCE.compiled
    monkeypatch.setattr(_at_once, "_AT_ONCE", Search())
    collide.find_contacts(x, y, radius, box=box_of(space, box))
    (*_, grids, _, numbers, room), found = taken[0]
    if found >= 0:
        marks = numbers[2 * room :][: x.size]
        _, balls = np.unique(np.where(marks < 0, ~marks, marks), return_counts=True)
        assert balls.sum() == x.size
        assert (balls.astype(float) ** 2).sum() / x.size < 40
        assert grids[0]["columns"] * grids[0]["rows"] < 5 * x.size
    if "gas" in trap or "sizes" in trap or "specks" in trap:
        assert (found < 0) == (trap in ("few balls among specks", "sizes over six decades", "sizes 1 to 20"))


@pytest.mark.fast
def test_neighbours_across_a_turn_of_a_far_torus():
    """Of 64 columns; so far out, a turn's number times the twist is more than a float64 counts to."""
    n, width = 100_000, 64 * 4.0  # of balls of radius 1, whose cells are a power of two here
    border = 2.0**52 + width * np.arange(n)
    x = np.concatenate((border - 1.0, border))
    for y, box in (
        (np.zeros(2 * n), None),
        (np.zeros(2 * n), (None, 1000.0)),
        (np.where(x > 2.0**53, 5e9, 7.0), (None, 1e10)),
    ):
        i, j = collide.find_contacts(x, y, 1.0, box=box)
        assert sorted(zip(i.tolist(), j.tolist(), strict=True)) == [(k, n + k) for k in range(n)]


@in_every_space
@pytest.mark.parametrize("axis", [0, 1])
@pytest.mark.parametrize("far", [2.0**50, 2.0**53, 2.0**60, 2.0**300])
def test_pairs_side_by_side_where_cells_are_more_than_float64_counts(far, axis, space):
    """Nobody else is near. What is far along the one axis is dense along the other."""
    rng = np.random.default_rng(16)
    n = 700
    along, across = np.tile(far * rng.uniform(1.0, 2.0, n), 2), rng.uniform(0.0, 20.0, n)
    position = [along, np.append(across, across + 1.5)]
    box = box_of(space, (4.0 * far, 30.0)[:: 1 - 2 * axis])
    i, j = check(*position[:: 1 - 2 * axis], 1.0, box=box)
    assert {(k, n + k) for k in range(n)} <= {*zip(i.tolist(), j.tolist(), strict=True)}

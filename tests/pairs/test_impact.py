"""Times of impact, against 150 digits: far away, close by, near a graze, and each case that has a rule of its own."""

import math

import mpmath
import numba
import numpy as np
import pytest
from mpmath import mpf

import collide
from collide._formulas import impact
from tests.helpers import naive
from tests.helpers.published import cases
from tests.helpers.sizes import sizes

INF, NAN = np.inf, np.nan
BOUND = 8  # eps, relative; of 200,000 encounters the worst was 2.9, in space 3.1, and 3.8 next to doubt
PLAIN_BOUND = {2: 7.25, 3: 7.9}  # where plain precision is sure; impact._plainly derives it
in_both = pytest.mark.parametrize("d", [2, 3])


def times(c, **options):
    """In the plane or in space, by how many columns there are."""
    return (collide.time_of_impact if len(c) == 5 else collide.time_of_impact_3d)(*c, **options)


def time_of_one(*pair):
    return (collide.scalar.time_of_impact if len(pair) == 5 else collide.scalar.time_of_impact_3d)(*pair)


def in_space(dx, dy, wx, wy, distance):
    """Encounters of the plane, each in a plane of its own: to within the rounding of d and w."""
    rng = np.random.default_rng(99)
    planes, _ = np.linalg.qr(rng.normal(size=(dx.size, 3, 2)))
    one, two = planes[..., 0].T, planes[..., 1].T
    return *(dx * one + dy * two), *(wx * one + wy * two), distance


def across(axis, dx, dy, wx, wy, distance):
    """An encounter in the plane across an axis of space."""
    return *np.insert([dx, dy], axis, 0.0, axis=0), *np.insert([wx, wy], axis, 0.0, axis=0), distance


def turned(dx, dy, wx, wy, distance):
    """Three times as large, exactly, and askew in space: by a matrix of small integers whose columns are orthogonal."""
    (d, w), turn = (np.array([[dx, dy], [wx, wy]])), np.array([[2, -1], [2, 2], [-1, 2]])
    return *(turn @ d), *(turn @ w), 3 * np.asarray(distance)


def encounters(n, seed=0, d=2):
    """d, w and R of pairs whose gap is 1e-15 to 1e8 of R, aimed at all parts of the disk and just past its edge."""
    rng = np.random.default_rng(seed)
    distance = 10.0 ** rng.uniform(-3, 3, n)
    length = distance * (1 + 10.0 ** rng.uniform(-15, 8, n))
    edge = rng.choice([-1.0, 1.0], n) * (1 + rng.choice([-1.0, 1.0], n) * 10.0 ** rng.uniform(-16, -1, n))
    aim = np.where(rng.random(n) < 0.5, rng.uniform(-1.2, 1.2, n), edge)
    direction = rng.uniform(-np.pi, np.pi, n)
    heading = direction + np.pi + np.arcsin(np.clip(aim * distance / length, -1, 1))
    speed = 10.0 ** rng.uniform(-3, 3, n)
    place, velocity = (r * np.array([np.cos(a), np.sin(a)]) for r, a in ((length, direction), (speed, heading)))
    return (*place, *velocity, distance) if d == 2 else in_space(*place, *velocity, distance)


def check(got, exact):
    """The error, relative, in eps; the decision between a time and none has to be right."""
    assert mpmath.isinf(exact) == math.isinf(got)
    if mpmath.isinf(exact) or exact == 0:
        assert got == float(exact)
        return 0.0
    return float(abs(mpf(float(got)) - exact) / exact) / naive.EPS


@pytest.mark.parametrize("case", cases("toi"))
def test_published(case):
    i = case["inputs"]
    (x1, y1), (x2, y2), (v1x, v1y), (v2x, v2y) = (map(float, i[key]) for key in ("x1", "x2", "v1", "v2"))
    args = x2 - x1, y2 - y1, v2x - v1x, v2y - v1y, float(i["r1"]) + float(i["r2"])
    want = float(case["expected"]["t"])
    for pair in (args, *(across(axis, *args) for axis in range(3))):
        for got in (time_of_one(*pair), times([np.full(9, a) for a in pair])[8]):
            np.testing.assert_allclose(got, want, rtol=1e-14)


@in_both
@sizes(usual=20_000, campaign=50_000)
def test_against_150_digits(d, size):
    c = encounters(size, d=d)
    got = times(c)
    assert 0.2 < np.isfinite(got).mean() < 0.9
    worst = max(check(t, naive.time_of_impact(*pair)) for t, *pair in zip(got, *c, strict=True))
    print(f"worst of {size}: {worst:.2f} eps")
    assert worst < BOUND


@in_both
def test_any_scale(d):
    """Lengths and velocities of 1e-270 to 1e270."""
    rng = np.random.default_rng(1)
    c = encounters(3000, seed=1, d=d)
    long, fast = 10.0 ** rng.uniform(-270, 270, 3000), 10.0 ** rng.uniform(-270, 270, 3000)
    usual = np.abs(np.log10(long) - np.log10(fast)) < 270
    c = [(x * (fast if d <= k < 2 * d else long))[usual] for k, x in enumerate(c)]
    for t, *pair in zip(times(c), *c, strict=True):
        assert check(t, naive.time_of_impact(*pair)) < BOUND


RULES = [
    ("at rest, apart", (3.0, 0.0, 0.0, 0.0, 1.0), INF),
    ("at rest, touching", (1.0, 0.0, 0.0, 0.0, 1.0), INF),
    ("at rest, overlapping", (0.5, 0.0, 0.0, 0.0, 1.0), INF),
    ("moving apart", (3.0, 0.0, 1.0, 0.0, 1.0), INF),
    ("overlapping, moving apart", (0.5, 0.0, 1.0, 0.0, 1.0), INF),
    ("overlapping, moving sideways", (0.0, 0.5, 1.0, 0.0, 1.0), INF),
    ("overlapping, approaching", (0.5, 0.0, -1.0, 0.0, 1.0), 0.0),
    ("just overlapping, approaching", (0.999999, 0.0, -1.0, 0.0, 1.0), 0.0),
    ("touching, approaching", (3.0, 4.0, -1.0, -1.0, 5.0), 0.0),
    ("touching, moving sideways", (3.0, 4.0, -4.0, 3.0, 5.0), INF),
    ("on the same place", (0.0, 0.0, 1.0, 1.0, 1.0), INF),
    ("an exact graze", (10.0, 2.0, -1.0, 0.0, 2.0), 10.0),
    ("an exact graze askew", (39.0, 2.0, -3.0, -4.0, 30.0), 5.0),
    ("a graze missed by a bit", (10.0, np.nextafter(2.0, 3.0), -1.0, 0.0, 2.0), INF),
    ("points that meet", (3.0, 4.0, -3.0, -4.0, 0.0), 1.0),
    ("points that miss", (3.0, 4.0, -3.0, -4.0001, 0.0), INF),
    ("points that miss by eps**2", (1 + 2.0**-52, 1.0, -1 - 2.0**-51, -1 - 2.0**-52, 0.0), INF),
    ("touching, almost sideways", (3.0, 4.0, -0.5209080710996719, 0.39068105332475384, 5.0), 0.0),
]


@pytest.mark.fast
@pytest.mark.parametrize(("pair", "want"), [pytest.param(*rule[1:], id=rule[0]) for rule in RULES])
def test_rules(pair, want):
    assert collide.time_of_impact(*pair) == collide.scalar.time_of_impact(*pair) == want
    for axis in range(3):
        assert times(across(axis, *pair)) == time_of_one(*across(axis, *pair)) == want


@pytest.mark.fast
def test_in_the_plane_space_has_the_bits_of_it():
    for c in (encounters(20_000, seed=9), next_to_doubt(5000, seed=9), [1e170 * x for x in encounters(200, seed=9)]):
        np.testing.assert_array_equal(times(across(2, *c)), times(c))


TOO_LATE = "the balls meet, but at a time that is too large for the dtype of the result"


def test_an_impact_too_far_in_the_future_is_not_told_as_never():
    late = (1e200, 0.0, -1e-200, 0.0, 1.0)
    with pytest.raises(collide.InvalidPairError, match=f"^{TOO_LATE}$"):
        collide.time_of_impact(*late)
    assert np.isnan(collide.time_of_impact(*late, invalid="nan"))
    with np.errstate(over="ignore"):
        assert np.isnan(collide.scalar.time_of_impact(*late))
    # One of two in an array, and of float32 where a float64 would do.
    with pytest.raises(collide.InvalidPairError, match=f"^pair 1: {TOO_LATE}$"):
        collide.time_of_impact([5.0, 1e200], 0.0, [-1.0, -1e-200], 0.0, 1.0)
    c = [np.array(x, np.float32) for x in ([1e30, 1e30, 1e30], [0, 0, 2e30], [-1e-5, -1e-20, -1e-20], [0] * 3, [1] * 3)]
    t = collide.time_of_impact(*c, invalid="nan")
    np.testing.assert_array_equal(np.isnan(t), [False, True, False])
    assert t[2] == INF
    np.testing.assert_array_equal(collide.time_of_impact(*(x.astype(float) for x in c)) < INF, [True, True, False])


def test_head_on_over_the_whole_range():
    """Where t = (d - R)/w, or nothing that a float64 holds; a factor on the way must not decide that."""
    rng = np.random.default_rng(6)
    n = 20_000
    d = rng.uniform(1, 2, n) * np.exp2(rng.integers(-1000, 1000, n))
    w = rng.uniform(1, 2, n) * np.exp2(rng.integers(-1060, 1000, n))  # some are subnormal
    reach = d * rng.choice([0.0, 0.5, 1 - 2.0**-10, 1 - 2.0**-50], n)
    t = collide.time_of_impact(d, 0.0, -w, 0.0, reach, invalid="nan")
    with np.errstate(over="ignore"):
        np.testing.assert_array_equal(t, collide.scalar.time_of_impact(d, 0.0, -w, 0.0, reach))
    largest = mpf(np.finfo(float).max)
    late = 0
    for k in range(n):
        exact = (mpf(d[k]) - mpf(reach[k])) / mpf(w[k])
        late += exact > largest
        if abs(exact - largest) > 1e-10 * largest:
            assert math.isnan(t[k]) == (exact > largest)
        if exact <= largest * (1 - 1e-10):
            assert abs(t[k] - exact) <= BOUND * naive.EPS * exact + 5e-324
    assert 1000 < late < n / 2


def next_to_doubt(n, seed=0, d=2):
    """Hits with the slope sqrt(D) (sqrt(D) - d.w) around 5/8 of the smaller of R^2 w.w and c w.w, of all gaps."""
    rng = np.random.default_rng(seed)
    gap = np.exp2(rng.uniform(-42, 38, n))  # c / R^2
    slope = 0.625 * (1 + rng.choice([-1.0, 1.0], n) * 10.0 ** rng.uniform(-16, -1, n)) * np.minimum(1.0, gap)
    root = slope / np.sqrt(gap + 2 * slope)  # where R and |w| are 1
    length, along, across = np.sqrt(1 + gap), np.sqrt(root**2 + gap), rng.choice([-1.0, 1.0], n) * np.sqrt(1 - root**2)
    angle, distance, speed = rng.uniform(-np.pi, np.pi, n), rng.uniform(1, 2, n), rng.uniform(1, 2, n)
    x, y = np.cos(angle), np.sin(angle)
    wx, wy = -along * x + across * y, -along * y - across * x
    c = distance * length * x, distance * length * y, speed / length * wx, speed / length * wy, distance
    return c if d == 2 else in_space(*c)


def decided(*c):
    """Which pairs plain precision says never meet, which it gives a time, and the time."""
    d, w, distance = c[: len(c) // 2], c[len(c) // 2 : -1], c[-1]
    never, usual, terms = impact._whether(d, w, distance)
    t, sure = impact._plainly(d, distance, *terms)
    return never, usual & sure & ~never, t


@in_both
@sizes(usual=3000, campaign=100_000)
def test_the_error_next_to_doubt(d, size):
    c = next_to_doubt(size, d=d)
    t = times(c)
    _, plain, _ = decided(*c)
    assert 0.4 < plain.mean() < 0.6
    errors = np.array([check(got, naive.time_of_impact(*pair)) for got, *pair in zip(t, *c, strict=True)])
    assert errors[~plain].max() < 2.5
    assert errors[plain].max() < PLAIN_BOUND[d]
    assert errors[plain].max() > 2.5  # as much is lost there that a bound on it is needed


def test_plain_precision_decides_nearly_every_pair():
    rng = np.random.default_rng(9)
    n = 200_000
    far = *rng.uniform(-50, 50, (2, n)), *rng.normal(size=(2, n)), rng.uniform(1, 2, n)
    angle, distance = rng.uniform(-np.pi, np.pi, n), rng.uniform(1, 2, n)
    length = distance * rng.uniform(1, 2, n)
    near = length * np.cos(angle), length * np.sin(angle), *rng.normal(size=(2, n)), distance
    for c, most in ((far, 1e-4), (near, 0.02), (in_space(*far), 1e-4), (in_space(*near), 0.02)):
        never, plain, _ = decided(*c)
        assert np.mean(~never & ~plain) <= most


@in_both
def test_who_decides(d):
    """Pairs that never meet by plain precision do not by twice the precision; who is in doubt has the bits of that."""
    for c in (encounters(20_000, seed=4, d=d), next_to_doubt(5000, seed=4, d=d)):
        never, plain, t = decided(*c)
        careful, _ = impact._carefully(c[:d], c[d:-1], c[-1])
        assert never.sum() + plain.sum() > 1000
        assert (~never & ~plain).sum() > 1000
        assert (careful[never] == INF).all()
        np.testing.assert_array_equal(times(c), np.where(never, INF, np.where(plain, t, careful)))


@in_both
def test_neighbours(d):
    """A pair that is sure, in doubt, too large for plain precision or at rest has the bits that it has alone."""
    kinds = encounters(40, seed=5, d=d), next_to_doubt(40, seed=5, d=d), [1e170 * x for x in encounters(20, 6, d)]
    c = [np.concatenate(x) for x in zip(*kinds, strict=True)]
    for x in c[d:-1]:
        x[::9] = 0.0
    order = np.random.default_rng(0).permutation(100)
    c = [x[order] for x in c]
    t = times(c)
    for k in range(100):
        assert times([x[k : k + 1] for x in c]) == time_of_one(*(x[k] for x in c))
        assert times([x[k : k + 1] for x in c]) == t[k]


@in_both
def test_balls_that_all_but_touch(d):
    """R is |d| rounded, or next to it: what d^2 - R^2 is then made of is in the last of twice as many bits."""
    rng = np.random.default_rng(8)
    n = 10_000
    place = rng.normal(size=(d, n)) * np.exp2(rng.integers(-3, 4, (d, n)))
    w = np.where(rng.random(n) < 0.5, rng.normal(size=(d, n)), -rng.uniform(0.5, 2, n) * place)
    reach = np.linalg.norm(place, axis=0)
    reach += rng.integers(-1, 2, n) * np.spacing(reach) * (rng.random(n) < 0.5)
    t = times((*place, *w, reach))
    _, plain, _ = decided(*place, *w, reach)
    assert not plain.any()  # whose bound has no second term
    worst = 0.0
    for k in range(n):
        exact = naive.time_of_impact(*place[:, k], *w[:, k], reach[k])
        assert mpmath.isinf(exact) == math.isinf(t[k])
        if not mpmath.isinf(exact):
            x, y = [*map(mpf, place[:, k])], [*map(mpf, w[:, k])]
            touching = mpf(2) ** -104 * sum(a * a for a in x) / -sum(a * b for a, b in zip(x, y, strict=True))
            error = abs(mpf(float(t[k])) - exact)
            assert error <= BOUND * naive.EPS * exact + touching
            worst = max(worst, float(error / exact) if exact else 0.0)
    assert worst > BOUND * naive.EPS  # the second term is needed


def test_the_bits_are_those_of_one_pair_compiled_and_not():
    @numba.njit
    def one_by_one(dx, dy, dvx, dvy, distance, t):
        for k in range(t.size):
            t[k] = collide.scalar.time_of_impact(dx[k], dy[k], dvx[k], dvy[k], distance[k])

    @numba.njit
    def one_by_one_in_space(dx, dy, dz, dvx, dvy, dvz, distance, t):
        for k in range(t.size):
            t[k] = collide.scalar.time_of_impact_3d(dx[k], dy[k], dz[k], dvx[k], dvy[k], dvz[k], distance[k])

    for d, loop in ((2, one_by_one), (3, one_by_one_in_space)):
        c, t = encounters(2003, seed=2, d=d), np.empty(2003)
        loop(*c, t)
        for part in (slice(None), slice(5, None), slice(0, 1)):
            np.testing.assert_array_equal(times([x[part] for x in c]), t[part])
        np.testing.assert_array_equal(time_of_one(*c), t)  # and no warning


def test_arrays_of_all_kinds():
    c = encounters(100_000, seed=3)
    want = collide.time_of_impact(*c)
    out = np.empty(100_000)
    assert collide.time_of_impact(*c, out=out) is out
    np.testing.assert_array_equal(out, want)
    table = np.stack(c, 1)
    np.testing.assert_array_equal(collide.time_of_impact(*table.T), want)
    np.testing.assert_array_equal(
        collide.time_of_impact(*c[:4], c[4][7]), collide.time_of_impact(*c[:4], np.full(100_000, c[4][7]))
    )
    dx = c[0].copy()
    assert collide.time_of_impact(dx, *c[1:], out=dx) is dx  # in place
    np.testing.assert_array_equal(dx, want)
    single = [x.astype(np.float32) for x in c]
    t = collide.time_of_impact(*single)
    assert t.dtype == np.float32
    np.testing.assert_array_equal(t, collide.time_of_impact(*(x.astype(np.float64) for x in single)).astype(np.float32))
    assert collide.time_of_impact([], [], [], [], 1.0).shape == (0,)
    assert isinstance(collide.time_of_impact(3, 0, -1, 0, 1), np.float64)


@pytest.mark.fast
@pytest.mark.parametrize("bad", [NAN, INF, -INF])
@pytest.mark.parametrize(
    ("function", "name"),
    [
        *((collide.time_of_impact, name) for name in ("dx", "dy", "dvx", "dvy", "distance")),
        *((collide.time_of_impact_3d, name) for name in ("dx", "dz", "dvy", "dvz", "distance")),
    ],
)
def test_what_is_not_finite(function, name, bad):
    usual = dict(dx=3.0, dy=0.5, dvx=-1.0, dvy=0.25, distance=1.0)
    usual |= dict(dz=0.125, dvz=0.0) if function is collide.time_of_impact_3d else {}
    c = {key: np.full(20, x) for key, x in usual.items()}
    want = function(**c)
    c[name][[3, 17]] = bad
    want[[3, 17]] = NAN
    out = np.zeros(20)
    rule = "must be finite and >= 0" if name == "distance" else "must be finite"
    with pytest.raises(collide.InvalidPairError, match=f"^pair 3: {name} = {bad}: {rule}") as info:
        function(**c, out=out)
    assert (info.value.index, info.value.count) == ((3,), 2)
    np.testing.assert_array_equal(out, want)
    np.testing.assert_array_equal(function(**c, invalid="nan"), want)


def test_errors():
    with pytest.raises(collide.InvalidPairError, match=r"distance = -1\.0: must be finite and >= 0"):
        collide.time_of_impact(3.0, 0.0, -1.0, 0.0, -1.0)
    assert collide.time_of_impact(3.0, 0.0, -1.0, 0.0, -0.0) == 3.0
    with pytest.raises(ValueError, match="invalid = 'keep': must be one of 'raise', 'nan'"):
        collide.time_of_impact(3.0, 0.0, -1.0, 0.0, 1.0, invalid="keep")
    with pytest.raises(TypeError, match="out is of type tuple: must be a NumPy array"):
        collide.time_of_impact([3.0], 0.0, -1.0, 0.0, 1.0, out=(np.empty(1),))
    with pytest.raises(ValueError, match=r"out has shape \(2,\): must have the broadcast shape, \(1,\)"):
        collide.time_of_impact([3.0], 0.0, -1.0, 0.0, 1.0, out=np.empty(2))


def test_nobody_is_warned_of_balls_at_rest():
    with np.errstate(all="raise"):
        assert collide.scalar.time_of_impact(3.0, 0.0, 0.0, 0.0, 1.0) == INF


@pytest.mark.fast
def test_exact_grazes_are_contacts():
    """With numbers of few bits and of all, askew and along an axis, far from the point of contact and close by."""
    rng = np.random.default_rng(7)
    for bits in (20, 40, 48):
        a, r, k = rng.integers(2 ** (bits - 1), 2**bits, (3, 3000)) | 1
        graze = 3 * a + 4 * r, 4 * a - 3 * r, -3 * k, -4 * k, 5 * r
        for c in (graze, turned(*graze), across(1, *graze)):
            t = times([x.astype(float) for x in c])
            np.testing.assert_allclose(t, a / k, rtol=BOUND * naive.EPS)
    for near in (1.0, 0.1, 1e-4, 1e-8):
        dx, distance, w = rng.uniform(0.5, 1, (3, 3000))
        for t in (
            collide.time_of_impact(near * dx, distance, -w, 0.0, distance),
            collide.time_of_impact_3d(0.0, near * dx, distance, 0.0, -w, 0.0, distance),
        ):
            np.testing.assert_allclose(t, near * dx / w, rtol=BOUND * naive.EPS)


@pytest.mark.fast
def test_far_grazes_are_told_from_misses():
    """By a unit in the last place, and from so far that the root of an error in D is nothing beside d.w."""
    rng = np.random.default_rng(10)
    n = 5000
    distance, w, place = rng.uniform(1.5, 2, n), rng.uniform(1, 2, n), rng.integers(-1, 2, n)
    dy = distance + place * np.spacing(distance)
    dx = np.exp2(rng.uniform(10, 100, n))
    t = collide.time_of_impact(dx, dy, -w, 0.0, distance)
    np.testing.assert_array_equal(t, collide.time_of_impact_3d(dx, 0.0, dy, -w, 0.0, 0.0, distance))
    np.testing.assert_array_equal(t == INF, place > 0)
    np.testing.assert_allclose(t[place <= 0], (dx / w)[place <= 0], rtol=1e-6)
    assert (t[dx > 2**30] < INF).any()


@pytest.mark.fast
@pytest.mark.parametrize("wy", [2**24 + 1, 2**25 + 1, 2**26 + 1])
def test_what_all_but_grazes(wy):
    """Whole numbers with R = 1 and (d x w)^2 = w.w + k: a miss by k/w.w, 2**-101 to 2**-84, or a hit."""
    decided = set()
    for k in (sign * 2**power for power in range(1, 11) for sign in (-1, 1)):
        wx = (wy * wy + k - 1) // 2  # so that w.w + k = (wx + 1)^2
        if math.gcd(wx, wy) > 1:
            continue
        # One solution of d x w = wx + 1, and the last multiple of w that is taken off for the balls to approach.
        dx = (wx + 1) * pow(wy, -1, wx) % wx
        dy = (dx * wy - wx - 1) // wx
        turns = (dx * wx + dy * wy) // (wx * wx + wy * wy) + 1
        dx, dy = dx - turns * wx, dy - turns * wy
        assert (dx * wy - dy * wx) ** 2 == wx * wx + wy * wy + k
        assert dx * wx + dy * wy < 0
        graze = float(dx), float(dy), float(wx), float(wy), 1.0
        for pair in (graze, across(0, *graze), across(1, *graze)):
            assert (times(pair) == math.inf) == (k > 0), k
        decided.add(k > 0)
    assert decided == {True, False}

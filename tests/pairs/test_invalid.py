"""Invalid pairs: each rule, in each place, under each `invalid`; the valid ones never suffer."""

import pickle

import numpy as np
import pytest

import collide
from collide._formulas.collision import normal
from collide._formulas.exact import dot

NAN, INF = np.nan, np.inf
GOOD = {
    "resolve_1d": dict(m1=1.0, m2=2.0, v1=3.0, v2=-1.0),
    "resolve_2d": dict(m1=1.0, m2=2.0, v1x=3.0, v1y=0.5, v2x=-1.0, v2y=0.25, nx=1.0, ny=1.0),
    "resolve_3d": dict(m1=1.0, m2=2.0, v1x=3.0, v1y=0.5, v1z=2.0, v2x=-1.0, v2y=0.25, v2z=0.5, nx=1.0, ny=1.0, nz=1.0),
    "resolve_polar": dict(m1=1.0, m2=2.0, v1=3.0, theta1=0.5, v2=1.0, theta2=3.0, phi=0.25),
}
EVERYWHERE = [
    (dict(m1=-1.0), "m1 = -1.0: a mass must be >= 0"),
    (dict(m2=-5e-324), "m2 = -5e-324: a mass must be >= 0"),
    (dict(m1=-INF), "m1 = -inf: a mass must be >= 0"),
    (dict(m1=NAN), "m1 = nan: a mass must be >= 0"),
    (dict(m1=NAN, m2=INF), "m1 = nan: a mass must be >= 0"),
    (dict(m1=INF, m2=NAN), "m2 = nan: a mass must be >= 0"),
    (dict(m1=INF, m2=-1.0), "m2 = -1.0: a mass must be >= 0"),
    (dict(m1=0.0, m2=0.0), "m1 = m2 = 0"),
    (dict(m1=-0.0, m2=0.0), "m1 = m2 = 0"),
    (dict(m1=INF, m2=INF), "m1 = m2 = inf"),
    (dict(restitution=-0.5), "restitution = -0.5: must be finite and >= 0"),
    (dict(restitution=INF), "restitution = inf: must be finite and >= 0"),
    (dict(restitution=NAN), "restitution = nan: must be finite and >= 0"),
]
CASES = [
    *((name, *case) for name in GOOD for case in EVERYWHERE),
    *(
        (name, {column: bad}, f"{column} = {bad}: must be finite")
        for name, good in GOOD.items()
        for column in list(good)[2:]
        for bad in (NAN, INF, -INF)
    ),
    ("resolve_2d", dict(nx=0.0, ny=-0.0), "nx = ny = 0"),
    ("resolve_3d", dict(nx=0.0, ny=-0.0, nz=0.0), "nx = ny = nz = 0"),
    ("resolve_1d", dict(v1=1.7e308, v2=-1.7e308), "too large for the dtype"),
    ("resolve_2d", dict(v1x=1.7e308, v2x=-1.7e308), "too large for the dtype"),
    ("resolve_3d", dict(v1z=1.7e308, v2z=-1.7e308), "too large for the dtype"),
    ("resolve_1d", dict(restitution=1.7e308), "too large for the dtype"),
]
PLACES = [0, 1, 7, 8, 12]  # of 13 pairs: first and last lane of a step, and its ragged end


def columns(name, bad, place, n=13):
    c = {key: np.full(n, value) for key, value in {**GOOD[name], "restitution": 1.0}.items()}
    for key, value in bad.items():
        c[key][place] = value
    return c


def before(name, c):
    if name == "resolve_polar":
        with np.errstate(invalid="ignore"):
            return [
                *(c["v1"] * np.cos(c["theta1"]), c["v1"] * np.sin(c["theta1"])),
                *(c["v2"] * np.cos(c["theta2"]), c["v2"] * np.sin(c["theta2"])),
            ]
    return [c[key] for key in c if key.startswith("v")]


@pytest.mark.fast
@pytest.mark.parametrize(("name", "bad", "reason"), CASES)
def test_every_rule(name, bad, reason):
    function = getattr(collide, name)
    good = function(**columns(name, {}, 0))
    for place in PLACES:
        c = columns(name, bad, place)
        with pytest.raises(collide.InvalidPairError) as info:
            function(**c)
        assert (info.value.index, info.value.count) == ((place,), 1)
        assert reason in info.value.reason
        others = np.arange(13) != place
        for u, g in zip(function(**c, invalid="nan"), good, strict=True):
            assert np.isnan(u[place])
            np.testing.assert_array_equal(u[others], g[others])
        for u, g, v in zip(function(**c, invalid="keep"), good, before(name, c), strict=True):
            np.testing.assert_allclose(u[place], v[place], rtol=1e-15)
            np.testing.assert_array_equal(u[others], g[others])


@pytest.mark.parametrize(("name", "bad", "reason"), CASES)
def test_every_rule_comes_before_approaching_only(name, bad, reason):
    if "too large" in reason:
        return  # a pair that is left alone has no result to be too large
    c = columns(name, bad, 5)
    if name == "resolve_polar":
        c["phi"] += np.pi
    else:
        c |= {key: c[key.replace(*swap)] for swap in ("12", "21") for key in c if key.startswith(f"v{swap[0]}")}
    result = getattr(collide, name)(**c, approaching_only=True, invalid="nan")
    # Two immovable balls that do not approach are skipped; everything else is an error even then.
    assert np.isnan(result[0][5]) == (reason != "m1 = m2 = inf")


def test_without_an_error_separating_pairs_stay_as_they_are():
    c = columns("resolve_2d", {}, 0)
    c["nx"][::2] *= -1
    c["ny"][::2] *= -1
    u = collide.resolve_2d(**c, approaching_only=True)
    all_of_them = collide.resolve_2d(**c)
    for got, v, w in zip(u, before("resolve_2d", c), all_of_them, strict=True):
        np.testing.assert_array_equal(got[::2], v[::2])
        np.testing.assert_array_equal(got[1::2], w[1::2])
        assert (got[::2] != w[::2]).all()


@pytest.mark.parametrize("invalid", ["raise", "keep", "nan"])
def test_a_million_in_place_with_some_invalid(invalid, keep_threads):
    collide.set_num_threads(3)
    rng = np.random.default_rng(0)
    n = 1_000_000
    c = [rng.uniform(0.1, 5, n) for _ in range(8)]
    want = collide.resolve_2d(*c)
    bad = np.sort(rng.choice(n, 1000, replace=False))
    c[0][bad[::2]], c[6][bad[1::2]], c[7][bad[1::2]] = -1.0, 0.0, 0.0
    held = [v[bad].copy() for v in c[2:6]]
    out = tuple(c[2:6])
    if invalid == "raise":
        with pytest.raises(collide.InvalidPairError) as info:
            collide.resolve_2d(*c, out=out)
        assert (info.value.index, info.value.count) == ((bad[0],), 1000)
        assert "1000 invalid pairs" in str(info.value)
    else:
        collide.resolve_2d(*c, out=out, invalid=invalid)
    valid = np.ones(n, bool)
    valid[bad] = False
    for u, w, h in zip(out, want, held, strict=True):
        np.testing.assert_array_equal(u[valid], w[valid])
        np.testing.assert_array_equal(u[bad], np.nan if invalid == "nan" else h)


@pytest.mark.fast
def test_the_index_in_several_dimensions():
    m1 = np.ones((3, 1, 4))
    m1[2, 0, 1] = NAN
    with pytest.raises(collide.InvalidPairError) as info:
        collide.resolve_1d(m1, 1.0, np.ones((5, 1)), 0.0)
    assert info.value.index == (2, 0, 1)
    assert info.value.count == 5
    assert all(type(i) is int for i in info.value.index)


@pytest.mark.fast
def test_a_single_pair():
    with pytest.raises(collide.InvalidPairError, match=r"^m1 = -1\.0: a mass must be >= 0") as info:
        collide.resolve_1d(-1.0, 1.0, 1.0, 0.0)
    assert (info.value.index, info.value.count) == ((), 1)


def test_what_is_too_large_for_float32():
    one = np.ones(3, np.float32)
    v = np.array([1, 3e38, 1], np.float32)
    with pytest.raises(collide.InvalidPairError, match=r"pair 1: .*too large"):
        collide.resolve_1d(one, one, v, -v, restitution=1.5)
    u1, u2 = collide.resolve_1d(one, one, v, -v, restitution=1.5, invalid="keep")
    assert (u1[1], u2[1]) == (v[1], -v[1])


def test_a_scalar_velocity_beyond_float32():
    one, v = np.ones(20, np.float32), np.zeros(20, np.float32)
    with pytest.raises(collide.InvalidPairError, match="too large") as info:
        collide.resolve_2d(one, one, v, 1e39, v, 1e39, one, v)  # equal, and across n: nothing changes
    assert info.value.count == 20


@pytest.mark.parametrize("dtype", [np.float64, np.float32])
def test_what_is_too_large_by_a_little(dtype):
    """A change far below the largest number takes a velocity that is near it beyond."""
    largest = np.finfo(dtype).max
    v1, v2 = np.full(20, 1.0, dtype), np.zeros(20, dtype)
    v1[3], v2[3] = largest, largest * dtype(1 - 1e-6)
    u1, u2 = collide.resolve_1d(INF, 1.0, v1, v2, invalid="nan")
    assert np.flatnonzero(np.isnan(u2)).tolist() == np.flatnonzero(np.isnan(u1)).tolist() == [3]


LARGE = [1e39, -1e39, 3e38, 1e154, -1e200, 1e308, 1.7976e308, -1.7976e308, INF, -INF, NAN, -NAN]
NASTY = np.array([0.0, -0.0, 5e-324, 2e-308, 1e-200, 0.5, 1.0, -1.0, 3.0, *LARGE])


@pytest.mark.parametrize("approaching_only", [False, True])
@pytest.mark.parametrize("dtype", [np.float64, np.float32])
@pytest.mark.parametrize("name", ["resolve_1d", "resolve_2d", "resolve_3d"])
def test_nasty_numbers_side_by_side(name, dtype, approaching_only):
    """A pair is invalid where NumPy's run of the formula, and of the rules, says so: each lane judged on its own."""
    rng = np.random.default_rng(6)
    n, n_columns = 100_000, len(GOOD[name])
    with np.errstate(all="ignore"):
        c = [rng.choice(NASTY, n).astype(dtype) for _ in range(n_columns)] + [rng.choice(NASTY, n).astype(dtype)]
        for column in c:  # most pairs differ from good ones in one or two numbers
            column[rng.random(n) < 0.7] = 1.5
        wide = [x.astype(np.float64) for x in c]
        m1, m2, e = wide[0], wide[1], wide[-1]
        valid = (m1 >= 0) & (m2 >= 0) & (m1 + m2 > 0) & (e >= 0) & (e < INF)
        if name == "resolve_1d":
            v, closing = wide[2:4], wide[2] - wide[3]
        else:
            d = n_columns // 3
            v = wide[2 : 2 + 2 * d]
            n, square, _ = normal(tuple(wide[2 + 2 * d : -1]))
            closing = dot(tuple(v[k] - v[d + k] for k in range(d)), n)
            valid &= (square > 0) & (square < INF)
        want = getattr(collide.scalar, name)(*wide)
        if approaching_only:
            want = [np.where(closing <= 0, old, new) for old, new in zip(v, want, strict=True)]
        want = [w.astype(dtype) for w in want]
        valid &= np.logical_and.reduce([np.isfinite(w) for w in want])
        got = getattr(collide, name)(*c[:-1], restitution=c[-1], approaching_only=approaching_only, invalid="nan")
    assert 0.05 < valid.mean() < 0.95
    for u, w in zip(got, want, strict=True):
        np.testing.assert_array_equal(u, np.where(valid, w, dtype(NAN)))


def test_the_error_tells_what_the_kernel_saw_although_the_input_was_overwritten():
    columns = [np.full(9000, x) for x in (1.0, 1.0, 2.0, 0.5, 1.0, 2.5, 0.25)]
    columns[3][8500] = NAN
    with pytest.raises(collide.InvalidPairError, match="pair 8500: theta1 = nan"):
        collide.resolve_polar(*columns, out=tuple(columns[2:6]))


def test_the_error_survives_pickling():
    error = pickle.loads(pickle.dumps(collide.InvalidPairError((1, 2), 3, "why")))
    assert (error.index, error.count, error.reason) == ((1, 2), 3, "why")
    assert str(error) == "pair (1, 2): why (3 invalid pairs in all)"
    assert isinstance(error, ValueError)


@pytest.mark.parametrize("dtype", ["f8", ">f8"])  # as they lie, and through blocks
def test_the_reason_is_that_of_the_first_pair_whatever_shares_and_blocks_found_others(dtype, keep_threads):
    collide.set_num_threads(3)
    n = 300_000
    m1, v1 = np.ones(n), np.ones(n)
    m1[1000::1000], v1[7] = -1.0, NAN
    m1, v1 = m1.astype(dtype), v1.astype(dtype)
    with pytest.raises(collide.InvalidPairError, match=r"^pair 7: v1 = nan: must be finite") as info:
        collide.resolve_1d(m1, 1.0, v1, 0.0)
    assert info.value.count == 300


@pytest.mark.parametrize(
    "name", ["resolve_1d", "resolve_2d", "resolve_3d", "resolve_polar", "impulse_2d", "impulse_3d"]
)
def test_two_immovable_balls_that_do_not_approach_are_left_alone(name):
    """As the docstrings say, on a line too."""
    function = getattr(collide, name)
    across = (0.0,) if name.endswith("2d") else (0.0, 0.0)
    between = {"resolve_1d": (0.0,), "resolve_polar": (0.0, 1.0, 0.0, 0.0)}.get(
        name, (*across, 1.0, *across, 1.0, *across)
    )
    u = function([np.inf], [np.inf], [-1.0], *between, approaching_only=True)
    assert (u[0] if name.startswith("resolve") else u - 1.0) == [-1.0]
    for approaching_only, v in ((True, 2.0), (False, -1.0)):
        with pytest.raises(collide.InvalidPairError, match="m1 = m2 = inf"):
            function([np.inf], [np.inf], [v], *between, approaching_only=approaching_only)
    assert "two immovable balls among" in " ".join(function.__doc__.split())


@pytest.mark.fast
@pytest.mark.parametrize(("dtype", "exponents"), [(np.float64, range(930, 1020)), (np.float32, range(65, 126))])
def test_a_small_change_of_the_largest_velocity(dtype, exponents):
    """It is the quick look's task to see that a change by so little, beside the largest velocity, may be too much."""
    largest = np.finfo(dtype).max
    for exponent in exponents:
        v2y = dtype(2.0) ** dtype(exponent)
        row = [dtype(x) for x in (1.0, 1.0, largest, 0.0, largest, v2y, 1.0, 1.0)]
        with np.errstate(over="ignore"):
            want = np.array(collide.scalar.resolve_2d(*map(float, row))).astype(dtype)
        got = np.array(collide.resolve_2d(*([x] for x in row), invalid="nan"))[:, 0]
        np.testing.assert_array_equal(got, want if np.isfinite(want).all() else np.nan, err_msg=str(exponent))

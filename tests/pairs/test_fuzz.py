"""Random calls against what they mean: shapes, strides, dtypes, options and numbers from a list of nasty ones.

Each call is checked against the one-pair formula on plain copies, bit for bit, with the rules written out here once
more, and a few of its pairs against 50 digits. A failure names its seed, and
`python -m tests.pairs.test_fuzz SECONDS SEED` begins there.
"""

import sys
import time
from typing import Any

import numpy as np

import collide
from collide._formulas.collision import normal
from collide._formulas.exact import dot
from tests.helpers import climb, naive
from tests.helpers.sizes import sizes

PLANE = ("m1", "m2", "v1x", "v1y", "v2x", "v2y", "nx", "ny", "restitution")
SPACE = ("m1", "m2", "v1x", "v1y", "v1z", "v2x", "v2y", "v2z", "nx", "ny", "nz", "restitution")
COLUMNS = {
    "resolve_1d": ("m1", "m2", "v1", "v2", "restitution"),
    "resolve_2d": PLANE,
    "resolve_3d": SPACE,
    "resolve_polar": ("m1", "m2", "v1", "theta1", "v2", "theta2", "phi", "restitution"),
    "impulse_2d": PLANE,
    "impulse_3d": SPACE,
    "time_of_impact": ("dx", "dy", "dvx", "dvy", "distance"),
    "time_of_impact_3d": ("dx", "dy", "dz", "dvx", "dvy", "dvz", "distance"),
}
SMALL = [0.0, -0.0, 5e-324, 2.2e-308, 1e-300, -1e-300, 1e-160, 1e-20, 0.1, 1 / 3, -0.5, 1.0, -1.0, np.pi / 2, np.pi]
LARGE = [3.0, 7e4, 2.0**53, 1e20, 1e22, 1e38, 3.5e38, 1e150, -1e155, 1e160, 1e300, 2.0**1023, 1.7e308]
NASTY = np.array([*SMALL, *LARGE, np.inf, -np.inf, np.nan])
SHAPES = [(), (1,), (5,), (33,), (64,), (3, 4), (2, 1, 7), (257,), (4100,), (9000,), (91, 100), (0,), (3, 0)]
DTYPES = ["f8"] * 8 + ["f4"] * 4 + ["f2", ">f8", ">f4", "i8", "i4", "u1", "i1", "?", "u8"]


def numbers(rng, name, shape):
    """Mostly what an argument may be, and now and then anything."""
    a = rng.uniform(0.1, 10.0, shape) if name in ("m1", "m2", "distance", "restitution") else rng.normal(0, 3, shape)
    a = np.asarray(a * 10.0 ** rng.integers(-3, 4))
    share = rng.choice([0.0, 0.0, 0.003, 0.3])
    odd = rng.random(shape) < share
    return np.where(odd, rng.choice(NASTY, shape), a)


def laid_out(rng, a):
    """The same numbers, somewhere else in memory."""
    way = rng.integers(0, 8)
    if way == 1:
        return np.asfortranarray(a)
    if way == 2 and a.ndim:
        return np.repeat(a, 2, axis=-1)[..., ::2]
    if way == 3 and a.ndim:
        return a[..., ::-1].copy()[..., ::-1]
    if way == 4:
        return np.frombuffer(b"\0" + a.tobytes(), np.uint8)[1:].view(a.dtype).reshape(a.shape)
    if way == 5 and a.ndim == 1 and a.size:
        return np.broadcast_to(a[0], a.shape)
    if way == 6:
        a = a.copy()
        a.flags.writeable = False
    return a


def argument(rng, name, shape):
    """A number or an array that broadcasts to the shape."""
    kind = rng.integers(0, 12)
    if kind == 0:
        return float(numbers(rng, name, ()))
    if kind == 1:
        return int(rng.integers(0, 5))
    if kind == 2:
        shape = ()
    elif kind == 3 and shape:
        shape = tuple(1 if rng.random() < 0.5 else n for n in shape)[rng.integers(0, len(shape)) :]
    with np.errstate(all="ignore"):
        a = numbers(rng, name, shape).astype(rng.choice(DTYPES))
    return laid_out(rng, a) if a.size else a


def result_dtype(values):
    weak = [{float: 0.0, int: 0}.get(type(v), getattr(v, "dtype", None)) for v in values]
    return np.dtype("f4") if np.result_type(*weak) in (np.dtype("f4"), np.dtype("f2")) else np.dtype("f8")


def meaning(function, values, shape, dtype, approaching_only):
    """What the valid pairs get, what `keep` leaves of the others, and which these are."""
    columns = [np.array(np.broadcast_to(np.asarray(v, np.float64), shape)) for v in values]
    with np.errstate(all="ignore"):
        if is_impact(function):
            t = np.asarray(getattr(collide.scalar, function)(*columns))
            told = (t == np.inf) | np.isfinite(t.astype(dtype))
            good = np.isfinite(columns).all(axis=0) & (columns[-1] >= 0) & told
            return [t.astype(dtype)], [np.full(shape, np.nan, dtype)], good
        m1, m2, *_, e = columns
        good = (m1 >= 0) & (m2 >= 0) & (m1 + m2 > 0) & (e >= 0) & (e < np.inf)
        if function == "resolve_polar":
            # From plain arrays: NumPy has another sine, so the formula itself has other bits there.
            before: Any
            after: Any
            *rest, e = columns
            before = collide.resolve_polar(-1, *rest[1:], invalid="keep")
            after = collide.resolve_polar(*rest, restitution=e, approaching_only=approaching_only, invalid="nan")
            closing = np.ones(shape)
        elif function == "resolve_1d":
            before, after = columns[2:4], collide.scalar.resolve_1d(*columns)
            closing = before[0] - before[1]
        else:
            d = len(columns) // 3 - 1
            v, (n, square, _) = columns[2 : 2 + 2 * d], normal(tuple(columns[2 + 2 * d : -1]))
            closing = dot(tuple(v[k] - v[d + k] for k in range(d)), n)
            good &= (square > 0) & (square < np.inf)
            after = getattr(collide.scalar, function)(*columns)
            before, after = ([np.zeros(shape)], [after]) if function.startswith("impulse") else (v, after)
        if approaching_only:
            after = [np.where(closing <= 0, old, new) for old, new in zip(before, after, strict=True)]
        after, before = ([np.asarray(u).astype(dtype) for u in us] for us in (after, before))
        return after, before, good & np.isfinite(after).all(axis=0)


def is_impact(function):
    return function.startswith("time_of_impact")


def outputs(rng, count, values, shape, dtype):
    """None, arrays of their own in some layout, the inputs, or arrays that lie across the inputs."""
    way = rng.integers(0, 5)
    if way == 0 or not shape:
        return None
    if way in (1, 2):
        out = [np.full(shape, 9.0, dtype) for _ in range(count)]
        return [np.asfortranarray(u) for u in out] if way == 2 else out
    fit = [v for v in values[2:] if getattr(v, "shape", None) == shape and v.dtype == dtype and v.flags.writeable]
    fit = [v for k, v in enumerate(fit) if not any(np.shares_memory(v, w) for w in fit[:k])]
    if len(fit) < count:
        return None
    if way == 3:
        return [fit[k] for k in rng.permutation(len(fit))[:count]]
    return [v[::-1] for v in fit[:count]]


def one_call(rng):
    function = str(rng.choice([*COLUMNS]))
    shape = SHAPES[rng.integers(0, len(SHAPES))]
    if np.prod(shape) > 3000 and rng.random() < 0.7:
        shape = (33,)
    values = [argument(rng, name, shape) for name in COLUMNS[function]]
    shape = np.broadcast_shapes(*(np.shape(v) for v in values))
    plain_types = rng.random() < 0.3  # the common case: arrays of one dtype as they lie
    if plain_types:
        dtype = rng.choice(["f8", "f4"])
        with np.errstate(all="ignore"):
            values = [np.array(np.broadcast_to(numbers(rng, n, shape), shape), dtype) for n in COLUMNS[function]]
    dtype = result_dtype(values)
    impact = is_impact(function)
    approaching_only = bool(rng.integers(0, 2)) and not impact
    invalid = str(rng.choice(["raise", "nan"] if impact else ["raise", "keep", "nan"]))
    after, before, good = meaning(function, values, shape, dtype, approaching_only)
    out = outputs(rng, len(after), values, shape, dtype)
    options: dict[str, Any] = {"invalid": invalid} | ({} if impact else {"approaching_only": approaching_only})
    inputs = values if impact else values[:-1]
    if not impact:
        options["restitution"] = values[-1]
    if out is not None:
        options["out"] = tuple(out) if len(after) > 1 else out[0]
    exact = [np.array(np.broadcast_to(np.asarray(v, np.float64), shape)) for v in values]

    collide.set_num_threads(int(rng.integers(1, 4)))
    error = None
    try:
        got = getattr(collide, function)(*inputs, **options)
        got = list(got) if isinstance(got, tuple) else [got]
    except collide.InvalidPairError as caught:
        error, got = caught, out
    bad = ~good
    assert (error is not None) == (invalid == "raise" and bool(bad.any()))
    if error is not None:
        assert error.count == bad.sum()
        assert error.index == tuple(np.argwhere(bad)[0])
        assert error.reason
    if got is None:
        return
    marked = np.asarray(np.nan, dtype)
    for u, new, old in zip(got, after, before, strict=True):
        want = np.where(good, new, marked if invalid == "nan" or impact else old)
        assert np.asarray(u).dtype == dtype
        assert np.shape(u) == shape
        np.testing.assert_array_equal(u, want)
    if dtype == np.float64:
        for k in np.argwhere(good)[:2] if good.ndim else [()] * int(good):
            against_50_digits(
                function, [float(c[tuple(k)]) for c in exact], [float(u[tuple(k)]) for u in after], approaching_only
            )


def against_50_digits(function, pair, got, approaching_only):
    """Within the bounds that the README gives, for the speeds that it gives."""
    if approaching_only or not function.startswith("resolve"):
        return  # impulses and times have bounds of their own, in test_impulse.py and test_impact.py
    want, before = getattr(naive, function)(*pair), naive.velocities_before(function, pair)
    if max(map(abs, before)) >= 1e-290 and max(map(abs, (*before, *want))) <= 1e290:
        error = naive.error_in_eps(got, want, before) / climb.allowance(pair[-1])
        assert error <= (10 if function == "resolve_polar" else 8)


def calls_for(seconds, seed):
    """As many calls as fit into so many seconds, a hundred at least, from this seed on; how many they were."""
    end, calls = time.monotonic() + seconds, 0
    before = collide.get_num_threads()
    try:
        while calls < 100 or time.monotonic() < end:
            try:
                one_call(np.random.default_rng(seed + calls))
            except Exception as error:
                raise AssertionError(
                    f"seed {seed + calls}: python -m tests.pairs.test_fuzz 0 {seed + calls}"
                ) from error
            calls += 1
    finally:
        collide.set_num_threads(before)
    return calls


@sizes(usual=3, campaign=60)
def test_random_calls(size):
    assert calls_for(size, seed=time.time_ns() // 1000 % 10**12) >= 100


if __name__ == "__main__":
    start = int(sys.argv[2]) if len(sys.argv) > 2 else time.time_ns() // 1000 % 10**12
    print(f"{calls_for(float(sys.argv[1]), start):,} calls from seed {start} on")

"""A search for the pairs on which a formula errs most: random starts, then mutations of the worst, again and again.

The batch functions take a hundred thousand candidates at a time, and twice the precision ranks them: 50 digits in
mpmath are for the one that is left. Seeded, and bounded by the number of candidates, so that it finds the same
everywhere. By hand, for as long as one likes, one climb after another:

    python -m tests.helpers.climb resolve_2d any 600
"""

import math
import os
import sys
import time
from concurrent.futures import ThreadPoolExecutor

import numba
import numpy as np
from mpmath import mp, mpf

import collide

N_COLUMNS = {"resolve_1d": 5, "resolve_2d": 9, "resolve_3d": 12, "resolve_polar": 8}
ANGLES = {"resolve_polar": (3, 5, 6)}
N_PARENTS = 20

# Numbers in twice the precision: unevaluated sums (high, low). Formulas as in Dekker 1971 and Joldes et al. 2017.


@numba.njit
def _sum(a, b):
    s = a + b
    t = s - a
    return s, (a - (s - t)) + (b - t)


@numba.njit
def _product(a, b):
    p = a * b
    c, d = 134217729.0 * a, 134217729.0 * b
    ah, bh = c - (c - a), d - (d - b)
    al, bl = a - ah, b - bh
    return p, ((ah * bh - p) + ah * bl + al * bh) + al * bl


@numba.njit
def _add(x, y):
    s, e = _sum(x[0], y[0])
    t, f = _sum(x[1], y[1])
    s, e = _sum(s, e + t)
    return _sum(s, e + f)


@numba.njit
def _times(x, y):
    p, e = _product(x[0], y[0])
    return _sum(p, e + (x[0] * y[1] + x[1] * y[0]))


@numba.njit
def _over(x, y):
    q = x[0] / y[0]
    rest = _add(x, _times((-q, 0.0), y))
    r = rest[0] / y[0]
    rest = _add(rest, _times((-r, 0.0), y))
    return _add(_sum(q, r), (rest[0] / y[0], 0.0))


@numba.njit
def _minus(x):
    return -x[0], -x[1]


@numba.njit
def _near_one(a, b):
    """The power of two that brings the larger of two finite numbers near 1."""
    return math.ldexp(1.0, min(1000, -math.frexp(max(abs(a), abs(b)))[1]))


@numba.njit
def _shares(m1, m2):
    if m1 == math.inf:
        return (0.0, 0.0), (1.0, 0.0)
    if m2 == math.inf:
        return (1.0, 0.0), (0.0, 0.0)
    s = _near_one(m1, m2)
    m1, m2 = s * m1, s * m2
    s = _near_one(m1, m2)
    m1, m2 = s * m1, s * m2
    total = _sum(m1, m2)
    return _over((m2, 0.0), total), _over((m1, 0.0), total)


@numba.njit
def _after(m1, m2, v1, v2, n, e):
    """Velocities after, all numbers but the masses in twice the precision."""
    w1, w2 = _shares(m1, m2)
    closing, square = (0.0, 0.0), (0.0, 0.0)
    for k in range(len(n)):
        closing = _add(closing, _times(_add(v1[k], _minus(v2[k])), n[k]))
        square = _add(square, _times(n[k], n[k]))
    q = _over(_times(_sum(1.0, e), closing), square)
    j1, j2 = _times(w1, q), _times(w2, q)
    u = np.empty((2, len(n), 2))
    for k in range(len(n)):
        u[0, k] = _add(v1[k], _minus(_times(j1, n[k])))
        u[1, k] = _add(v2[k], _times(j2, n[k]))
    return u


@numba.njit
def _pair_error(m1, m2, v1, v2, n, e, got):
    """The largest error, in 2**-52 of the largest component before or after. Velocities from about 1e-200 to 1e200."""
    u = _after(m1, m2, v1, v2, n, e)
    scale, error = 0.0, 0.0
    for k in range(len(n)):
        scale = max(scale, abs(v1[k][0]), abs(v2[k][0]), abs(u[0, k, 0]), abs(u[1, k, 0]))
        for ball in range(2):
            difference = (got[ball * len(n) + k] - u[ball, k, 0]) - u[ball, k, 1]
            error = max(error, abs(difference))
    return error / scale * 2.0**52 if scale > 0.0 else 0.0


@numba.njit(error_model="numpy", nogil=True)
def errors_1d(c, got):
    errors = np.empty(c.shape[1])
    for k in range(c.shape[1]):
        m1, m2, v1, v2, e = c[0, k], c[1, k], c[2, k], c[3, k], c[4, k]
        s = _near_one(v1, v2)
        errors[k] = _pair_error(m1, m2, ((s * v1, 0.0),), ((s * v2, 0.0),), ((1.0, 0.0),), e, s * got[:, k])
    return errors


@numba.njit(error_model="numpy", nogil=True)
def errors_2d(c, got):
    errors = np.empty(c.shape[1])
    for k in range(c.shape[1]):
        s = _near_one(max(abs(c[2, k]), abs(c[3, k])), max(abs(c[4, k]), abs(c[5, k])))
        v1, v2 = ((s * c[2, k], 0.0), (s * c[3, k], 0.0)), ((s * c[4, k], 0.0), (s * c[5, k], 0.0))
        f = _near_one(c[6, k], c[7, k])
        n = ((f * c[6, k], 0.0), (f * c[7, k], 0.0))
        errors[k] = _pair_error(c[0, k], c[1, k], v1, v2, n, c[8, k], s * got[:, k])
    return errors


@numba.njit(error_model="numpy", nogil=True)
def errors_3d(c, got):
    errors = np.empty(c.shape[1])
    for k in range(c.shape[1]):
        s = _near_one(np.max(np.abs(c[2:8, k])), 0.0)
        v1 = (s * c[2, k], 0.0), (s * c[3, k], 0.0), (s * c[4, k], 0.0)
        v2 = (s * c[5, k], 0.0), (s * c[6, k], 0.0), (s * c[7, k], 0.0)
        f = _near_one(np.max(np.abs(c[8:11, k])), 0.0)
        n = (f * c[8, k], 0.0), (f * c[9, k], 0.0), (f * c[10, k], 0.0)
        errors[k] = _pair_error(c[0, k], c[1, k], v1, v2, n, c[11, k], s * got[:, k])
    return errors


# pi/2 in four doubles, and 1/k! in twice the precision.
_HALF_PI = (1.5707963267948966, 6.123233995736766e-17, -1.4973849048591833e-33, 4.320570262296456e-50)
with mp.workdps(50):
    _FACTORIALS = [mp.factorial(k) for k in range(28)]
    _INVERSE = np.array([(float(1 / f), float(1 / f - mpf(float(1 / f)))) for f in _FACTORIALS])


@numba.njit
def _sine_and_cosine(x):
    """Of angles up to a few thousand, where the closest multiple of pi/2 is still some 1e-20 away at least."""
    k = np.rint(x / _HALF_PI[0])
    r = (x, 0.0)
    for part in _HALF_PI:
        r = _add(r, _product(-k, part))
    square = _times(r, r)
    s, c = (0.0, 0.0), (0.0, 0.0)
    for i in range(13, -1, -1):
        sign = 1.0 if i % 2 == 0 else -1.0
        c = _add(_times(c, square), (sign * _INVERSE[2 * i, 0], sign * _INVERSE[2 * i, 1]))
        s = _add(_times(s, square), (sign * _INVERSE[2 * i + 1, 0], sign * _INVERSE[2 * i + 1, 1]))
    s = _times(s, r)
    quarter = int(k) % 4
    if quarter == 1:
        s, c = c, _minus(s)
    elif quarter == 2:
        s, c = _minus(s), _minus(c)
    elif quarter == 3:
        s, c = _minus(c), s
    return s, c


@numba.njit(error_model="numpy", nogil=True)
def errors_polar(c, got):
    errors = np.empty(c.shape[1])
    for k in range(c.shape[1]):
        s = _near_one(c[2, k], c[4, k])
        (s1, c1), (s2, c2), (sn, cn) = _sine_and_cosine(c[3, k]), _sine_and_cosine(c[5, k]), _sine_and_cosine(c[6, k])
        one, two = (s * c[2, k], 0.0), (s * c[4, k], 0.0)
        v1, v2 = (_times(one, c1), _times(one, s1)), (_times(two, c2), _times(two, s2))
        errors[k] = _pair_error(c[0, k], c[1, k], v1, v2, (cn, sn), c[7, k], s * got[:, k])
    return errors


ERRORS = {"resolve_1d": errors_1d, "resolve_2d": errors_2d, "resolve_3d": errors_3d, "resolve_polar": errors_polar}


def errors_of(name, c):
    """The errors of a table of candidates, a column each, as the contract counts them; -1 where a pair is not valid."""
    got = np.array(getattr(collide, name)(*c[:-1], restitution=c[-1], invalid="nan"))
    # By threads of our own: a team of OpenMP's would be left in the process.
    cuts = np.linspace(0, c.shape[1], os.cpu_count() + 1).astype(int)
    with ThreadPoolExecutor() as pool:
        parts = pool.map(lambda a, b: ERRORS[name](c[:, a:b], got[:, a:b]), cuts[:-1], cuts[1:])
        errors = np.concatenate(list(parts)) / allowance(c[-1])
    return np.where(np.isfinite(got).all(0) & np.isfinite(errors), errors, -1.0)


def allowance(e):
    """How many times as much error as a collision that gains no energy one with this restitution may have."""
    return np.maximum(1.0, (1.0 + e) / 2.0)


# Candidates.

RESTITUTIONS = {"one": (1.0, 1.0), "any": (0.0, 1.0), "large": (0.0, 1e6)}


def _restitution(rng, kind, n):
    """In the kind's range, a half of them next to 0, 1/2, 1 or 3/4."""
    low, high = RESTITUTIONS[kind]
    if low == high:
        return np.full(n, high)
    spread = np.exp2(rng.uniform(-53, 0, n)) * rng.choice([-1.0, 1.0], n)
    near = rng.choice([0.0, 0.5, 0.75, 1.0], n) * (1 + spread) + spread * (rng.random(n) < 0.3)
    e = np.where(rng.random(n) < 0.5, near, rng.random(n))
    if high > 1.0:
        e *= np.exp2(rng.uniform(0, math.log2(high), n))
    return np.clip(e, low, high)


def starts(rng, name, kind, n, wide):
    """Random pairs, of ordinary sizes or of all."""
    columns = N_COLUMNS[name]
    c = rng.uniform(-1.0, 1.0, (columns, n)) * np.exp2(rng.integers(-3, 4, (columns, n)))
    if wide:
        c *= np.exp2(np.where(rng.random((columns, n)) < 0.5, 0, rng.integers(-200, 200, (columns, n))))
        c[2:-1] *= np.exp2(rng.integers(-250, 250, n))
        c[:2] *= np.exp2(rng.integers(-600, 600, n))
    c[:2] = abs(c[:2])
    for ball in (0, 1):
        special = rng.random(n)
        c[ball, special < 0.03], c[ball, special > 0.9] = 0.0, math.inf
    c[0, np.isinf(c[0]) & np.isinf(c[1])] = 1.0
    for angle in ANGLES.get(name, ()):
        c[angle] = rng.uniform(-7, 7, n)
    c[-1] = _restitution(rng, kind, n)
    return c


def mutants(rng, name, kind, parents, n):
    """The parents' children: each differs in one place or some."""
    c = parents[:, rng.integers(0, parents.shape[1], n)]
    columns = len(c)
    way = rng.integers(0, 8, n)
    hit = rng.random((columns, n)) < rng.choice([1.0 / columns, 2.0 / columns, 0.5, 1.0], n)
    steps = rng.integers(-3, 4, (columns, n))
    ulps = c + steps * np.spacing(np.where(np.isfinite(c), c, 1.0))
    factors = c * (1 + np.exp2(rng.uniform(-52, 0, n)) * rng.standard_normal((columns, n)))
    twos = c * np.exp2(rng.integers(-2, 3, (columns, n)))
    c = np.select([hit & (way < 3), hit & (way < 6), hit & (way < 7)], [ulps, factors, twos], c)
    each = np.flatnonzero(way == 7)
    # A velocity component takes another's place, or that of one of the normal; a mass that of the other.
    low = np.where(rng.random(each.size) < 0.2, 0, 2)
    high = np.where(low == 0, 2, columns - 1)
    source, target = rng.integers(low, high), rng.integers(low, high)
    c[target, each] = c[source, each] * rng.choice([-1.0, 1.0], each.size)
    # Or comes from a second parent.
    other = np.flatnonzero(rng.random(n) < 0.05)
    place = rng.integers(0, columns, other.size)
    c[place, other] = parents[place, rng.integers(0, parents.shape[1], other.size)]
    c[:2] = abs(c[:2])
    for angle in ANGLES.get(name, ()):
        c[angle] = np.where(abs(c[angle]) < 1000.0, c[angle], 1.0)
    c[-1] = np.clip(abs(c[-1]), *RESTITUTIONS[kind])
    return c


def climb(name, kind, seed, size=4_000_000, *, wide=False, batch=100_000):
    """The largest error found among so many candidates, a fifth of them random, and its pair."""
    rng = np.random.default_rng(seed)
    best, worst = np.empty((N_COLUMNS[name], 0)), np.empty(0)
    for k in range(0, size, batch):
        c = starts(rng, name, kind, batch, wide) if k < size // 5 else mutants(rng, name, kind, best, batch)
        errors = errors_of(name, c)
        some = np.argpartition(errors, -N_PARENTS)[-N_PARENTS:]
        best, worst = np.append(best, c[:, some], axis=1), np.append(worst, errors[some])
        _, first = np.unique(worst, return_index=True)  # no twins
        kept = first[-N_PARENTS:]
        best, worst = best[:, kept], worst[kept]
    return worst[-1], best[:, -1]


if __name__ == "__main__":
    name, kind, seconds = sys.argv[1], sys.argv[2], float(sys.argv[3])
    end, seed, worst = time.monotonic() + seconds, 0, 0.0
    while time.monotonic() < end:
        for wide in (False, True):
            error, pair = climb(name, kind, seed, wide=wide)
            if error > worst:
                worst = error
                print(f"{name} {kind}: {error:.3f} eps by seed {seed}, wide={wide}, at {pair.tolist()}")
        seed += 1
    print(f"{name} {kind}: {worst:.3f} eps in {2 * seed} climbs")

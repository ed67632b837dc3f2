"""Contract 1: the error against 50 digits, over the whole range; and a climb towards the worst case."""

import multiprocessing
import os

import naive
import numpy as np
import pairs
import pytest

import collide

N = 200_000
# In 2**-52 of the pair's largest velocity component before or after.
BOUND = {"resolve_2d": 8.0, "resolve_polar": 10.0, "resolve_1d": 8.0}


def before_of(name, row):
    if name == "resolve_polar":
        return [*naive.polar_to_cartesian(row[2], row[3]), *naive.polar_to_cartesian(row[4], row[5])]
    return row[2:4] if name == "resolve_1d" else row[2:6]


def row_error(name, row, got):
    return naive.error_in_eps(got, getattr(naive, name)(*row), before_of(name, row))


def worst_of(job):
    name, rows, results = job
    return max((row_error(name, row, got), row) for row, got in zip(rows, results, strict=True))


def worst_error(name, columns):
    """The largest error over a batch, and its pair, by all processors."""
    *inputs, e = columns
    results = np.array(getattr(collide, name)(*inputs, restitution=e)).T.tolist()
    rows = np.array(columns).T.tolist()
    jobs = [(name, rows[i : i + 5000], results[i : i + 5000]) for i in range(0, len(rows), 5000)]
    # spawn: the children need mpmath only, and forking a process with threads is deprecated
    with multiprocessing.get_context("spawn").Pool(os.cpu_count()) as pool:
        return max(pool.imap_unordered(worst_of, jobs))


def test_cartesian():
    error, row = worst_error("resolve_2d", pairs.cartesian(N, 1))
    print(f"worst of {N} pairs: {error:.2f} eps, at {row}")
    assert error <= BOUND["resolve_2d"]


def test_polar():
    error, row = worst_error("resolve_polar", pairs.polar(N, 2))
    print(f"worst of {N} pairs: {error:.2f} eps, at {row}")
    assert error <= BOUND["resolve_polar"]


def test_line():
    m1, m2, v1, v2, *_, e = pairs.cartesian(N // 4, 3)
    error, row = worst_error("resolve_1d", (m1, m2, v1, v2, e))
    print(f"worst of {N // 4} pairs: {error:.2f} eps, at {row}")
    assert error <= BOUND["resolve_1d"]


@pytest.mark.parametrize("name", ["resolve_2d", "resolve_polar"])
def test_climb_to_the_worst_case(name):
    """From the worst of a sample, small steps in all arguments, those kept that make the error larger."""
    rng = np.random.default_rng(7)
    error, row = worst_error(name, getattr(pairs, "polar" if name == "resolve_polar" else "cartesian")(20_000, 4))
    for step in np.geomspace(0.3, 1e-6, 40):
        tries = np.array(row) * (1 + step * rng.standard_normal((100, len(row))))
        tries[:, -1] = np.abs(tries[:, -1])
        *inputs, e = tries.T
        results = np.array(getattr(collide, name)(*inputs, restitution=e)).T.tolist()
        error, row = max((error, row), worst_of((name, tries.tolist(), results)))
    print(f"{name}: worst found {error:.2f} eps, at {row}")
    assert error <= BOUND[name]


def test_masses_and_normals_beyond_the_contract():
    """The whole floating-point range: largest, smallest, subnormal."""
    sizes = [5e-324, 1.5e-323, 1e-310, 2.2e-308, 1.0, 1e308, 1.7976931348623157e308]
    for m1 in sizes:
        for m2 in sizes:
            for nx in (3 * sizes[0], sizes[2], sizes[4], sizes[6]):
                row = [m1, m2, 1.0, 0.5, -0.25, 2.0, nx, -nx / 3, 1.0]
                got = collide.resolve_2d(*row[:-1])
                assert row_error("resolve_2d", row, got) <= BOUND["resolve_2d"], row


@pytest.mark.parametrize("length", [1e-300, 1e-200, 1e-100, 1e-59, 1.0, 1e59, 1e100, 1e200, 1e300])
@pytest.mark.parametrize("speed", [1e-290, 1e-200, 1e150, 1e290])
def test_neither_speed_nor_length_depends_on_the_other(length, speed):
    for m2 in (1.0, 1e-300):
        row = [1.0, m2, 0.3 * speed, 0.1 * speed, speed, 0.0, length, 0.7 * length, 0.5]
        got = collide.resolve_2d(*row[:-1], restitution=0.5)
        assert row_error("resolve_2d", row, got) <= BOUND["resolve_2d"]


def test_equal_masses_exchange_their_velocities_exactly():
    v = np.arange(1.0, 1000.0)
    u1, u2 = collide.resolve_1d(v / 7, v / 7, v, -3.0)
    np.testing.assert_array_equal(u1, -3.0)
    np.testing.assert_array_equal(u2, v)

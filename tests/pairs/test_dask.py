"""Dask arrays: lazy, chunk by chunk, the same bits; on threads, on worker processes, and when one of them dies."""

import inspect
import os
import signal
import sys
import threading
import time
from typing import Any

import dask
import dask.array as da
import numpy as np
import pytest
import xarray as xr
from dask.distributed import Client, LocalCluster

import collide
import collide.dask
from collide._compile import team
from collide._pairs import chunks, execution

N = 10_000
RNG = np.random.default_rng(0)
MASSES, VELOCITIES, NORMALS = RNG.uniform(0.5, 2.0, (2, N)), RNG.normal(size=(4, N)), RNG.normal(size=(2, N))
PLANE, SPACE = (*MASSES, *VELOCITIES, *NORMALS), (*MASSES, *RNG.normal(size=(9, N)))
CALLS = {
    "resolve_1d": (*MASSES, *VELOCITIES[:2]),
    "resolve_2d": PLANE,
    "resolve_3d": SPACE,
    "resolve_polar": (*MASSES, *VELOCITIES, NORMALS[0]),
    "impulse_2d": PLANE,
    "impulse_3d": SPACE,
    "time_of_impact": (*VELOCITIES, MASSES[0]),
    "time_of_impact_3d": (*SPACE[2:8], MASSES[0]),
}
IN_ANY_CASE = "resolve_2d", "time_of_impact_3d"
N_OUTPUTS = {"resolve_1d": 2, "resolve_2d": 4, "resolve_3d": 6, "resolve_polar": 4}


def several(u):
    return u if isinstance(u, tuple) else (u,)


@pytest.fixture
def calls(monkeypatch):
    """How many chunks are resolved, and on which threads of how many."""
    seen = []
    attempt = execution.attempt

    def counting(form, inputs, *rest):
        if any(np.size(a) for a in inputs if np.ndim(a)):
            seen.append((threading.get_ident(), collide._system.threads.is_shared(1 << 30, 1)))
        return attempt(form, inputs, *rest)

    monkeypatch.setattr(execution, "attempt", counting)
    return seen


@pytest.mark.parametrize("name", CALLS)
def test_the_bits_are_those_of_the_batch_function(name, calls):
    expected = several(getattr(collide, name)(*CALLS[name]))
    calls.clear()
    lazy = several(getattr(collide.dask, name)(*(da.from_array(c, chunks=3000) for c in CALLS[name])))
    assert calls == []  # nothing is computed yet
    assert len(lazy) == N_OUTPUTS.get(name, 1)
    for u, got, right in zip(lazy, dask.compute(*lazy), expected, strict=True):
        assert (u.shape, u.dtype, u.chunks) == (right.shape, right.dtype, ((3000, 3000, 3000, 1000),))
        np.testing.assert_array_equal(got, right, strict=True)
    # Of all outputs together each chunk was computed once, on its task's thread only.
    assert len(calls) == 4
    assert not any(shared for _, shared in calls)


def test_results_have_names():
    assert collide.dask.resolve_2d(*(da.ones(3),) * 8)._fields == ("u1x", "u1y", "u2x", "u2y")
    assert collide.dask.resolve_1d(*(da.ones(3),) * 4)._fields == ("u1", "u2")


@pytest.mark.parametrize(
    "joined", [lambda u: da.stack(u), lambda u: da.concatenate([x[::2] for x in u]), lambda u: sum(u)]
)
def test_the_kernel_is_shared_by_what_is_made_of_its_results(joined, calls):
    joined(collide.dask.resolve_2d(*(da.from_array(c, chunks=2500) for c in PLANE))).compute(scheduler="sync")
    assert len(calls) == 4


def test_broadcasting_and_chunks_of_different_sizes():
    a, b, c = RNG.uniform(0.5, 2.0, (40, 1)), RNG.uniform(0.5, 2.0, 30), RNG.uniform(0.5, 2.0, (5, 40, 30))
    lazy = collide.dask.resolve_1d(
        da.from_array(a, chunks=7), da.from_array(b, chunks=11), da.from_array(c, chunks=(2, 9, 30)), b
    )
    expected = collide.resolve_1d(a, b, c, b)
    for u, right in zip(lazy, expected, strict=True):
        assert u.shape == right.shape
        np.testing.assert_array_equal(u.compute(), right, strict=True)


@pytest.mark.parametrize(
    ("kinds", "dtype"), [(("f4", "f4"), "f4"), (("f2", "f4"), "f4"), (("f4", "f8"), "f8"), (("i4", "f4"), "f8")]
)
def test_dtypes_are_those_of_the_batch_function(kinds, dtype):
    m, v = np.arange(1, 9).astype(kinds[0]), np.arange(8).astype(kinds[1])
    u = collide.dask.resolve_1d(da.from_array(m, chunks=3), 2.0, da.from_array(v, chunks=3), 0).u1
    assert u.dtype == u._meta.dtype == dtype  # numbers of Python's are weak
    assert type(u._meta) is np.ndarray
    np.testing.assert_array_equal(u.compute(), collide.resolve_1d(m, 2.0, v, 0).u1, strict=True)


@pytest.mark.parametrize(
    "as_array", [lambda a: a, list, xr.DataArray, lambda a: xr.DataArray(da.from_array(a, chunks=3))]
)
def test_other_arrays_are_taken_too(as_array):
    v = np.arange(8.0)
    u = collide.dask.resolve_1d(1.0, 2.0, as_array(v), da.from_array(v, chunks=3) * 0.0).u2
    assert isinstance(u, da.Array)
    np.testing.assert_array_equal(u.compute(), collide.resolve_1d(1.0, 2.0, v, 0.0 * v).u2)


def test_numbers_only_and_no_elements():
    assert collide.dask.resolve_1d(1.0, 1.0, 3.0, da.asarray(5.0)).u1.compute() == 5.0
    assert collide.dask.time_of_impact(3.0, 0.0, -1.0, 0.0, 1.0).compute() == 2.0
    assert collide.dask.resolve_1d(1.0, 1.0, da.ones(0), 5.0).u1.compute().shape == (0,)


@pytest.mark.parametrize("ndim", [33, 63])
def test_many_dimensions(ndim):
    v = np.arange(3.0).reshape((1,) * (ndim - 1) + (3,))
    for other in (1.0, da.ones(3)):
        u = collide.dask.resolve_1d(1.0, other, da.from_array(v), 0.0).u2.compute()
        np.testing.assert_array_equal(u, v, strict=True)
    with pytest.raises(ValueError, match="arguments of 64 dimensions: must have fewer than 64"):
        collide.dask.resolve_1d(1.0, 1.0, da.ones((1,) * 64), 0.0)


NUMBERS: dict[str, Any] = {
    "Python's": float,
    "an integer": lambda x: 3,
    "a large integer": lambda x: 10**20,
    "float64": np.float64,
    "float32": np.float32,
    "an array of no dimensions": np.array,
    "one of float32": lambda x: np.array(x, np.float32),
    "int8": lambda x: np.int8(3),
}


@pytest.mark.parametrize(
    "name",
    [pytest.param(name, marks=() if name in IN_ANY_CASE else pytest.mark.campaign) for name in CALLS],
)
def test_numbers_only_give_the_very_results_of_the_batch_function(name):
    """Whichever of them decides on the dtype: none is rounded to it before."""
    rng = np.random.default_rng(1)
    for first, others in [*(("Python's", kind) for kind in NUMBERS), *((kind, "Python's") for kind in NUMBERS)]:
        values = [NUMBERS[others](x) for x in rng.uniform(0.5, 2.0, len(CALLS[name]))]
        values[0] = NUMBERS[first](rng.uniform(0.5, 2.0))
        if first == others:
            values[3] = np.float32(values[3])
        got = dask.compute(*several(getattr(collide.dask, name)(*values)), scheduler="sync")
        for u, right in zip(got, several(getattr(collide, name)(*values)), strict=True):
            assert np.asarray(u).dtype == right.dtype
            np.testing.assert_array_equal(u, right)


def test_an_invalid_pair_is_named_by_its_index_in_the_whole():
    m1 = np.ones((10, 100))
    m1[9, 77] = -1.0
    for rule, kept in (("keep", 3.0), ("nan", np.nan)):
        u = collide.dask.resolve_1d(da.from_array(m1, chunks=(4, 30)), 1.0, 3.0, 0.0, invalid=rule).u1.compute()
        np.testing.assert_array_equal(u, np.where(m1 < 0, kept, 0.0))
    with pytest.raises(collide.InvalidPairError, match=r"pair \(9, 77\): m1 = -1.0") as raised:
        collide.dask.resolve_1d(da.from_array(m1, chunks=(4, 30)), 1.0, 3.0, 0.0).u2.compute()
    assert raised.value.index == (9, 77)


ONES = da.ones(8, chunks=3)
WRONG = {
    "unknown chunks": (
        ValueError,
        {"m2": ONES[ONES > 0]},
        "m2 has chunks of unknown sizes: call its compute_chunk_sizes",
    ),
    "shapes": (ValueError, {"m2": da.ones(7)}, "do not broadcast together: m1 (8,), m2 (7,)"),
    "complex": (TypeError, {"v1": ONES + 1j}, "v1: the dtype complex128 is not supported"),
    "text": (TypeError, {"v1": "fast"}, "v1: the dtype <U4 is not supported"),
    "masked": (TypeError, {"v1": np.ma.masked_array([1.0] * 8)}, "v1: masked arrays are not supported"),
    "masked chunks": (TypeError, {"v1": da.ma.masked_array(ONES, ONES > 2)}, "v1: masked arrays are not supported"),
    "ragged": (TypeError, {"v1": [[1], [1, 2]]}, "v1 = [[1], [1, 2]]: must be an array of numbers"),
    "none": (TypeError, {"v1": None}, "v1: the dtype object is not supported"),
    "invalid": (ValueError, {"invalid": "ignore"}, "invalid = 'ignore'"),
    "approaching_only": (TypeError, {"approaching_only": 1}, "approaching_only = 1"),
}


@pytest.mark.parametrize("case", WRONG)
def test_wrong_arguments_are_refused_at_once(case):
    kind, arguments, words = WRONG[case]
    with pytest.raises(kind) as raised:
        collide.dask.resolve_1d(**{"m1": ONES, "m2": 1.0, "v1": 1.0, "v2": 0.0, **arguments})
    assert words in str(raised.value)


def test_on_threads_no_more_run_than_dask_has(calls, keep_threads, monkeypatch):
    """Not even for chunks that a plain call would share out."""
    collide.set_num_threads(4)
    columns = [da.from_array(RNG.uniform(0.5, 2.0, 1_000_000), chunks=250_000) for _ in range(4)]
    together, shared = team.together, []
    monkeypatch.setattr(team, "together", lambda *call: shared.append(call) or together(*call))
    with dask.config.set(scheduler="threads", num_workers=2):
        dask.compute(*collide.dask.resolve_1d(*columns))
    assert len({thread for thread, _ in calls}) <= 2
    assert not shared  # no thread of collide's was even asked
    collide.resolve_1d(*(np.ones(1_000_000),) * 4)
    assert shared


@pytest.mark.parametrize("name", CALLS)
def test_options(name):
    columns = [c[:500].copy() for c in CALLS[name]]
    columns[0][[3, 4]] = np.nan
    lazy = [da.from_array(c, chunks=77) for c in columns]
    cases: list[dict[str, Any]] = [{"invalid": "nan"}]
    if not name.startswith("time_of_impact"):
        e = RNG.uniform(0.0, 1.0, 500)
        cases += [{"approaching_only": True}, {"restitution": 0.5}, {"restitution": e}]
    for options in cases:
        given = {k: da.from_array(v, chunks=77) if np.ndim(v) else v for k, v in options.items()}
        options, given = ({"invalid": "nan", **case} for case in (options, given))
        expected = several(getattr(collide, name)(*columns, **options))
        for u, right in zip(several(getattr(collide.dask, name)(*lazy, **given)), expected, strict=True):
            np.testing.assert_array_equal(u.compute(), right)
    with pytest.raises(collide.InvalidPairError) as raised:
        dask.compute(*several(getattr(collide.dask, name)(*lazy)))
    assert (raised.value.index, raised.value.count) == ((3,), 2)


def test_numbers_only_have_the_dtype_of_the_batch_function():
    f4 = np.float32
    assert (
        collide.dask.resolve_1d(1.0, f4(1), f4(3), f4(0)).u1.dtype
        == collide.resolve_1d(1.0, f4(1), f4(3), f4(0)).u1.dtype
    )
    assert collide.dask.resolve_1d(10**30, 1.0, 3.0, 0.0).u1.compute() == 3.0


def test_nothing_is_computed_while_the_graph_is_built():
    computed = []
    zero = da.from_delayed(dask.delayed(lambda: computed.append(1) or np.float64(1.0))(), (), float)
    u = collide.dask.resolve_1d(xr.DataArray(zero), 1.0, da.ones(3), 0.0).u2
    assert computed == []
    np.testing.assert_array_equal(u.compute(), 1.0)


def test_blocks_of_another_dtype_than_their_array():
    x = da.ones(8, chunks=3, dtype="f4").map_blocks(lambda b: b.astype("f8"), dtype="f4")
    u = collide.dask.resolve_1d(x, 1.0, 2.0, 0.0).u1
    assert u.dtype == u.compute().dtype == np.float32


@pytest.mark.parametrize(
    ("sizes", "kind"),
    [((3, 3, 2), range), ((3,), range), ((3, 3, 4), list), ((2, 3, 2), list), ((0, 0), list), ((0,), list)],
)
def test_starts_of_chunks(sizes, kind):
    starts = chunks._starts(sizes)
    assert type(starts) is kind
    assert list(starts)[: len(sizes)] == [sum(sizes[:k]) for k in range(len(sizes))]


# On a cluster


@pytest.fixture(
    scope="module",
    params=[(2, 1, True), pytest.param((1, 2, True), marks=pytest.mark.campaign), (1, 2, False)],
    ids=["2 x 1", "1 x 2", "threads"],
)
def cluster(request, tmp_path_factory):
    workers, threads, processes = request.param
    folder = tmp_path_factory.mktemp("workers")
    with (
        LocalCluster(
            n_workers=workers,
            threads_per_worker=threads,
            processes=processes,
            dashboard_address=":0",
            local_directory=str(folder),
        ) as cluster,
        Client(cluster),
    ):
        yield cluster


def store(folder, columns, chunk):
    for name, column in zip(NAMES, columns, strict=True):
        da.to_npy_stack(folder / name, da.from_array(column, chunks=chunk))


NAMES = ("m1", "m2", "v1x", "v1y", "v2x", "v2y", "nx", "ny")


class Npy:
    """A column on disk that workers write parts of: each maps it anew."""

    def __init__(self, path, n):
        self.path = path
        np.lib.format.open_memmap(path, "w+", float, (n,))

    def __setitem__(self, where, values):
        np.load(self.path, mmap_mode="r+")[where] = values


def test_a_store_on_disk(cluster, tmp_path):
    store(tmp_path, PLANE, 1500)
    u = collide.dask.resolve_2d(*(da.from_npy_stack(tmp_path / name) for name in NAMES))
    da.store(list(u), [Npy(tmp_path / f"{name}.npy", N) for name in u._fields], lock=False)
    for name, right in collide.resolve_2d(*PLANE)._asdict().items():
        np.testing.assert_array_equal(np.load(tmp_path / f"{name}.npy"), right)


def slowly(x, seconds):
    time.sleep(seconds)
    return x


def test_a_worker_that_is_killed_on_the_way(tmp_path):
    columns = [np.resize(c, 40_000) for c in PLANE]
    with (
        LocalCluster(
            n_workers=2, threads_per_worker=1, dashboard_address=":0", local_directory=str(tmp_path)
        ) as cluster,
        Client(cluster) as client,
    ):
        if sys.platform == "win32":
            pytest.skip("Windows has no SIGKILL, by which the worker dies here")
        first, *rest = (da.from_array(c, chunks=1000) for c in columns)
        u = collide.dask.resolve_2d(first.map_blocks(slowly, 0.1, dtype=float), *rest)
        futures = client.compute(list(u))
        before = dict(client.run(os.getpid))
        time.sleep(1.0)
        assert not all(f.done() for f in futures)
        os.kill(next(iter(before.values())), signal.SIGKILL)
        results = client.gather(futures)
        after = dict(client.run(os.getpid))
    assert set(after.values()) != set(before.values())  # it was replaced
    for got, right in zip(results, collide.resolve_2d(*columns), strict=True):
        np.testing.assert_array_equal(got, right)


@pytest.mark.fast
@pytest.mark.parametrize("name", collide.dask.__all__)
def test_the_arguments_are_those_of_the_batch_function(name):
    given = inspect.signature(getattr(collide.dask, name)).parameters
    wanted = dict(inspect.signature(getattr(collide, name)).parameters)
    del wanted["out"]
    assert [(p.name, p.kind, p.default) for p in given.values()] == [
        (p.name, p.kind, p.default) for p in wanted.values()
    ]


@pytest.mark.parametrize("d", [2, 3])
def test_vectors_have_the_chunks_of_the_arguments(d):
    v1, n = np.random.default_rng(0).normal(size=(6, d)), np.arange(1.0, d + 1)
    rows = da.from_array(v1, chunks=(3, 1))
    u = collide.dask.resolve(1.0, 2.0, rows, 0.0 * n, n)
    assert u.u1.chunks == u.u2.chunks == ((3, 3), (d,))
    for got, want in zip(u, collide.resolve(1.0, 2.0, v1, 0.0 * n, n), strict=True):
        np.testing.assert_array_equal(got.compute(), want)
    with pytest.raises(ValueError, match=r"^v1 has shape \(6, 4\): its last axis must have length 2 or 3"):
        collide.dask.resolve(1.0, 2.0, da.ones((6, 4)), 0.0 * n, n)
    with pytest.raises(
        ValueError, match=rf"^v2 has shape \({5 - d},\): its last axis must have length {d}, as that of v1"
    ):
        collide.dask.resolve(1.0, 2.0, rows, np.zeros(5 - d), n)
    with pytest.raises(ValueError, match=r"^n has shape \(\): its last axis must have length 2 or 3"):
        collide.dask.resolve(1.0, 2.0, rows, 0.0 * n, 1.0)

"""Dask: two worker processes of one thread each beside one process of two threads, on the same store on disk.

The store is COLLIDE_STORE_PAIRS pairs, 16 million unless it says otherwise, a million a chunk, read and written back
by each worker itself.
"""

from __future__ import annotations

import os
import shutil
import statistics

import make_pairs
import numpy as np
import pytest

import collide

N = int(os.environ.get("COLLIDE_STORE_PAIRS", "16000000"))
CHUNK = 1_000_000
ROUNDS = 7


class Column:
    """A column on disk, of which each worker maps the part that it reads or writes."""

    ndim, dtype = 1, np.dtype(np.float64)

    def __init__(self, path):
        self.path, self.shape = path, (N,)

    def __getitem__(self, where):
        return np.load(self.path, mmap_mode="r")[where]

    def __setitem__(self, where, values):
        np.load(self.path, mmap_mode="r+")[where] = values


def resolve_store(folder):
    """Lazily, from disk to disk: read where it is resolved."""
    import dask.array as da

    import collide.dask

    def read(name):
        return da.from_array(Column(folder / f"{name}.npy"), CHUNK, inline_array=True, meta=np.empty(0))

    u = collide.dask.resolve_2d(*map(read, make_pairs.NAMES))
    targets = [Column(folder / f"{name}.npy") for name in u._fields]
    return da.store(list(u), targets, lock=False, compute=False)


@pytest.fixture(scope="module")
def store(tmp_path_factory):
    folder = tmp_path_factory.mktemp("store") / "pairs"
    make_pairs.main(N, folder)
    for name in ("u1x", "u1y", "u2x", "u2y"):
        np.lib.format.open_memmap(folder / f"{name}.npy", "w+", float, (N,))
    yield folder
    shutil.rmtree(folder)


def plainly(folder):
    """All of it by one call of collide's, from map to map."""
    columns = [np.load(folder / f"{name}.npy", mmap_mode="r") for name in make_pairs.NAMES]
    names = ("u1x", "u1y", "u2x", "u2y")
    out = tuple(np.asarray(np.load(folder / f"{name}.npy", mmap_mode="r+")) for name in names)
    collide.resolve_2d(*map(np.asarray, columns), out=out)


@pytest.fixture(scope="module")
def clients():
    from dask.distributed import Client, LocalCluster

    def cluster(workers, threads):
        return LocalCluster(n_workers=workers, threads_per_worker=threads, dashboard_address=":0", silence_logs=40)

    with cluster(2, 1) as two, cluster(1, 2) as one, Client(two) as first, Client(one) as second:
        yield first, second


@pytest.mark.parametrize(("rival", "bound"), [("1 process of 2 threads", 0.8), ("one call without Dask", 0.0)])
def test_two_processes_of_one_thread(race, benchmark, store, clients, rival, bound):
    two, one = clients

    def run(client):
        return lambda: client.compute(resolve_store(store), sync=True)

    reference = run(one) if bound else lambda: plainly(store)
    expected = collide.resolve_2d(*(np.load(store / f"{name}.npy") for name in make_pairs.NAMES))
    for contestant in (run(two), reference):
        for column in expected._fields:
            np.load(store / f"{column}.npy", mmap_mode="r+")[:] = 0.0
        contestant()
        for column, u in expected._asdict().items():
            np.testing.assert_array_equal(np.load(store / f"{column}.npy"), u)
    benchmark.group = f"{N:,} pairs from disk to disk by Dask, 2 processes of 1 thread"
    ratio = statistics.median(race(run(two), reference, 1, ROUNDS, cluster=rival))
    rate = N / benchmark.stats.stats.median / 1e6
    benchmark.extra_info["rate"] = rate
    print(f"\n{benchmark.group}: {rate:.1f} M pairs/s, {ratio:.2f} of {rival}, at least {bound}", end=" ")
    assert ratio >= bound

"""Dask: two worker processes of one thread each beside one process of two threads, on the same store on disk.

The store is COLLIDE_STORE_PAIRS pairs, 16 million unless it says otherwise, a million a chunk, read and written back
by each worker itself.
"""

from __future__ import annotations

import os
import shutil
import statistics
import time

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


def test_two_processes_of_one_thread_beside_one_of_two(store):
    from dask.distributed import Client, LocalCluster

    def cluster(workers, threads):
        return LocalCluster(n_workers=workers, threads_per_worker=threads, dashboard_address=":0")

    seconds = {"2 x 1": [], "1 x 2": [], "one call": []}
    with cluster(2, 1) as two, cluster(1, 2) as one, Client(two) as first, Client(one) as second:

        def run(client):
            client.compute(resolve_store(store), sync=True)

        contestants = {"2 x 1": lambda: run(first), "1 x 2": lambda: run(second), "one call": lambda: plainly(store)}
        for k in range(ROUNDS + 1):
            for name, contestant in contestants.items():
                began = time.perf_counter()
                contestant()
                if k:  # the first compiles
                    seconds[name].append(time.perf_counter() - began)
        expected = collide.resolve_2d(*(np.load(store / f"{name}.npy") for name in make_pairs.NAMES))
        for name in contestants:
            for column in expected._fields:
                np.load(store / f"{column}.npy", mmap_mode="r+")[:] = 0.0
            contestants[name]()
            for column, u in expected._asdict().items():
                np.testing.assert_array_equal(np.load(store / f"{column}.npy"), u)
    ratios = {
        name: statistics.median(b / a for a, b in zip(seconds["2 x 1"], seconds[name], strict=True)) for name in seconds
    }
    rate = N / statistics.median(seconds["2 x 1"]) / 1e6
    print(
        f"\n{N:,} pairs from disk to disk, 2 processes of 1 thread: {rate:.1f} M pairs/s, {ratios['1 x 2']:.2f} of the "
        f"rate of 1 process of 2 threads, {ratios['one call']:.2f} of one call without Dask",
        end=" ",
    )
    assert ratios["1 x 2"] >= 0.8

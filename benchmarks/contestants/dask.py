"""Dask: a store of pairs on disk, resolved chunk by chunk on a cluster, or by one call without it."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import make_pairs
import numpy as np

import collide

CHUNK = 1_000_000


class Column:
    """A column on disk, of which each worker maps the part that it reads or writes."""

    ndim, dtype = 1, np.dtype(np.float64)

    def __init__(self, path: Path) -> None:
        self.path, self.shape = path, np.load(path, mmap_mode="r").shape

    def __getitem__(self, where: Any) -> Any:
        return np.load(self.path, mmap_mode="r")[where]

    def __setitem__(self, where: Any, values: Any) -> None:
        np.load(self.path, mmap_mode="r+")[where] = values


def make_store(n: int, folder: Path) -> None:
    make_pairs.main(n, folder)
    for name in make_pairs.RESULTS:
        np.lib.format.open_memmap(folder / f"{name}.npy", "w+", float, (n,))


@contextlib.contextmanager
def client(workers: int, threads: int) -> Iterator[Any]:
    from dask.distributed import Client, LocalCluster

    options = {"dashboard_address": ":0", "silence_logs": 40}
    with LocalCluster(n_workers=workers, threads_per_worker=threads, **options) as cluster, Client(cluster) as of_it:
        yield of_it


def on_cluster(client: Any, folder: Path) -> None:
    """From disk to disk: read where it is resolved."""
    import dask.array as da

    import collide.dask

    def read(name: str) -> Any:
        return da.from_array(Column(folder / f"{name}.npy"), CHUNK, inline_array=True, meta=np.empty(0))

    u = collide.dask.resolve_2d(*map(read, make_pairs.NAMES))
    targets = [Column(folder / f"{name}.npy") for name in make_pairs.RESULTS]
    client.compute(da.store(list(u), targets, lock=False, compute=False), sync=True)


def in_one_call(folder: Path) -> None:
    """All of it by one call of collide's, from map to map."""
    columns = [np.load(folder / f"{name}.npy", mmap_mode="r") for name in make_pairs.NAMES]
    out = tuple(np.asarray(np.load(folder / f"{name}.npy", mmap_mode="r+")) for name in make_pairs.RESULTS)
    collide.resolve_2d(*map(np.asarray, columns), out=out)

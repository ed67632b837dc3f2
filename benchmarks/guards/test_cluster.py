"""Two worker processes of Dask's, of one thread each, keep up with one process of two threads."""

from __future__ import annotations

import statistics

import duels
from cases import STORE_PAIRS

from . import hold


def test_two_processes_of_one_thread(store, clients):
    what = f"{STORE_PAIRS:,} pairs from disk to disk by 2 processes of 1 thread, as fast as by 1 process of 2 threads"
    hold(what, *duels.cluster(*clients, store), 7, statistics.median, least=0.8)

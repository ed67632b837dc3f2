"""Dask: two worker processes of one thread each beside one process of two threads, on the same store on disk.

The store is COLLIDE_STORE_PAIRS pairs, 16 million unless it says otherwise, a million a chunk, read and written back
by each worker itself.
"""

from __future__ import annotations

import duels
import pytest
from cases import STORE_PAIRS


@pytest.mark.parametrize("rival", ["1 process of 2 threads", "one call without Dask"])
def test_two_processes_of_one_thread(race, benchmark, store, clients, rival):
    two, one = clients
    benchmark.group = f"{STORE_PAIRS:,} pairs from disk to disk by Dask, 2 processes of 1 thread"
    duel = duels.cluster(two, one if rival == "1 process of 2 threads" else None, store)
    race(*duel, 7, n=STORE_PAIRS, cluster=rival)

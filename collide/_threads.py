"""One range of pairs, split over a pool of threads.

Kernels run without the GIL, so plain threads do, and have none of the faults of Numba's layers: `workqueue` aborts on
concurrent calls, `omp` kills a forked child. The caller takes a share, and takes over every share that has not started
when its own is done: a busy, forked or closing pool makes a call slower, never stuck.
"""

from __future__ import annotations

import contextlib
import itertools
import math
import operator
import os
import threading
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor, wait
from pathlib import Path
from typing import TypeVar

Result = TypeVar("Result")

# Fewer pairs than this a thread are not worth the 30 to 80 us that a thread costs.
_PAIRS_A_THREAD = 1 << 14
# Shares begin at multiples of this, so that all of them start on a cache line if the first does.
_GRAIN = 64

_lock = threading.Lock()
_num_threads: int | None = None
_pool: ThreadPoolExecutor | None = None


def get_num_threads() -> int:
    """The number of threads that a large batch runs on, the caller's included.

    At first it is the environment variable COLLIDE_NUM_THREADS, else the number of processors that the process may
    use: its affinity mask and its control group's quota count.

    >>> collide.get_num_threads() >= 1
    True
    """
    global _num_threads
    if _num_threads is None:
        _num_threads = _default_num_threads()
    return _num_threads


def set_num_threads(n: int) -> None:
    """Sets the number of threads that a large batch runs on, for the whole process.

    n: int >= 1, the caller's thread included. TypeError if it is no integer, ValueError if it is below 1. The result
    of a batch does not depend on it.

    >>> collide.set_num_threads(2)
    >>> collide.get_num_threads()
    2
    """
    global _num_threads, _pool
    if isinstance(n, bool):
        raise TypeError(f"n = {n!r}: the number of threads must be an integer")
    try:
        n = operator.index(n)
    except TypeError:
        raise TypeError(f"n = {n!r}: the number of threads must be an integer") from None
    if n < 1:
        raise ValueError(f"n = {n}: the number of threads must be at least 1")
    with _lock:
        _num_threads = n
        if _pool is not None:
            _pool.shutdown(wait=False)  # what it has begun it ends
            _pool = None


def run(task: Callable[[int, int], Result], n: int) -> list[Result]:
    """task(start, stop) over shares that make up range(n), on as many threads as n is worth; the results in order."""
    threads = max(1, min(get_num_threads(), n // _PAIRS_A_THREAD))
    if threads == 1:
        return [task(0, n)]
    cuts = [n * i // threads // _GRAIN * _GRAIN for i in range(threads)] + [n]
    shares = list(itertools.pairwise(cuts))
    futures: list[Future[Result] | None] = []
    try:
        futures += [_submit(task, *share) for share in shares[1:]]
        results = [task(*shares[0])]
        for share, future in zip(shares[1:], futures, strict=True):
            if future is None or future.cancel():
                results.append(task(*share))
            else:
                results.append(future.result())
        return results
    finally:
        # Also when interrupted: no thread may go on writing into the arrays of a call that has ended.
        wait([future for future in futures if future is not None and not future.cancel()])


def _submit(task: Callable[[int, int], Result], start: int, stop: int) -> Future[Result] | None:
    """None where the pool takes no work: another thread has just replaced it, or the interpreter is closing."""
    global _pool
    with _lock:
        if _pool is None:
            _pool = ThreadPoolExecutor(max(1, get_num_threads() - 1), thread_name_prefix="collide")
        pool = _pool
    with contextlib.suppress(RuntimeError):
        return pool.submit(task, start, stop)
    return None


def _default_num_threads() -> int:
    text = os.environ.get("COLLIDE_NUM_THREADS")
    if text is not None:
        if not (text.isascii() and text.isdigit() and int(text) >= 1):
            raise ValueError(f"COLLIDE_NUM_THREADS = {text!r}: must be an integer of at least 1")
        return int(text)
    available = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    return max(1, min(available, _quota()))


def _quota() -> int:
    """The processors that the control group grants, rounded up; a very large number where it sets no limit."""
    with contextlib.suppress(OSError, ValueError):  # version 2; "max" is no number
        quota, period = Path("/sys/fs/cgroup/cpu.max").read_text().split()
        return math.ceil(int(quota) / int(period))
    with contextlib.suppress(OSError, ValueError):  # version 1; -1 is no limit
        folder = Path("/sys/fs/cgroup/cpu")
        quota_us = int((folder / "cpu.cfs_quota_us").read_text())
        if quota_us > 0:
            return math.ceil(quota_us / int((folder / "cpu.cfs_period_us").read_text()))
    return 1 << 30


def _after_fork() -> None:
    """A forked child has none of the pool's threads, and a lock that another thread may have held."""
    global _lock, _pool
    _lock, _pool = threading.Lock(), None


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_after_fork)

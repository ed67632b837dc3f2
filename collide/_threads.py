"""One range of pairs, split over a pool of threads.

Kernels run without the GIL, so plain threads do, and have none of the faults of Numba's layers: `workqueue` aborts on
concurrent calls, `omp` kills a forked child. The caller takes a share, and takes over every share that has not started
when its own is done: a busy, forked or closing pool makes a call slower, never stuck.
"""

from __future__ import annotations

import _thread
import contextlib
import itertools
import math
import operator
import os
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from queue import SimpleQueue
from typing import Any, Generic, TypeVar

import numpy as np

Result = TypeVar("Result")

# To wake a thread takes some 60 us on a virtual machine. A batch is therefore cut into more shares than threads: the
# caller works on until the others are there, and whoever is slowed down takes fewer. But each share means taking the
# GIL again, which beside a busy thread of pure Python can take 5 ms: not too many.
_PAIRS_A_SHARE = 1 << 15
_SHARES_A_THREAD = 4
# Shares begin at multiples of this, so that all of them start on a cache line if the first does.
_GRAIN = 64

_lock = threading.Lock()
_local = threading.local()
_num_threads: int | None = None
_pool: _Pool | None = None


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
    if isinstance(n, bool | np.bool_):
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
            _pool.close()
            _pool = None


def is_shared(n: int) -> bool:
    """Whether n pairs are worth more than the caller's thread."""
    return n >= 2 * _PAIRS_A_SHARE and get_num_threads() > 1 and not getattr(_local, "alone", False)


@contextlib.contextmanager
def alone() -> Iterator[None]:
    """Calls within stay on the caller's thread: for callers that are one of several, each with a share of its own."""
    before = getattr(_local, "alone", False)
    _local.alone = True
    try:
        yield
    finally:
        _local.alone = before


def run(task: Callable[[int, int], Result], n: int, grain: int = _GRAIN, work: int = 1) -> list[Result]:
    """task(start, stop) over shares that make up range(n), on all threads if that is worth it; the results in order.

    Shares begin at multiples of the grain. `work`: how many pairs take the time of one of the n.
    """
    if not is_shared(n * work):
        return [task(0, n)]
    threads = get_num_threads()
    count = min(n * work // _PAIRS_A_SHARE, _SHARES_A_THREAD * threads)
    cuts = [n * i // count // grain * grain for i in range(count)] + [n]
    shares = [_Share(task, start, stop) for start, stop in itertools.pairwise(cuts)]
    me = object()
    try:
        for _ in range(min(threads, count) - 1):
            _offer(shares[::-1])  # from the other end, so that each thread's shares adjoin
        for share in shares:
            if share.claim(me):
                share.result = task(*share.range)
        for share in shares:
            if not share.claim(me):
                share.wait()
    finally:
        # Also when interrupted, here or above: no thread may go on writing into the arrays of a call that has ended.
        for share in shares:
            if not share.claim(me):
                share.wait()
    for share in shares:
        if share.error is not None:
            raise share.error
    return [share.result for share in shares]  # type: ignore[misc]


# An interrupt may come between any two steps of the interpreter. What a thread could wait for therefore consists of
# primitives written in C: threading.Event, Condition and the pool of concurrent.futures can be left locked for ever.


class _Share(Generic[Result]):
    """A part of the range. It runs once, by whoever claims it first: a worker or the caller."""

    def __init__(self, task: Callable[[int, int], Result], start: int, stop: int) -> None:
        self.task, self.range = task, (start, stop)
        self.result: Result | None = None
        self.error: BaseException | None = None
        self._owner: dict[str, object] = {}
        self._running = _thread.allocate_lock()
        self._running.acquire()

    def claim(self, who: object) -> bool:
        """Whether it belongs to them, by this claim or an earlier one."""
        return self._owner.setdefault("", who) is who

    def work(self) -> None:
        """What a worker does with it."""
        if self.claim(object()):
            try:
                self.result = self.task(*self.range)
            except BaseException as error:
                self.error = error
            self._running.release()

    def wait(self) -> None:
        """Until the worker that has claimed it is done."""
        with self._running:
            pass


class _Pool:
    """Daemon threads that take lists of shares from a queue, and of those what is not claimed."""

    def __init__(self, size: int) -> None:
        self._size, self._missing = size, size
        self._queue: SimpleQueue[list[_Share[Any]] | None] = SimpleQueue()

    def offer(self, shares: list[_Share[Any]]) -> None:
        with contextlib.suppress(RuntimeError):  # out of threads, or the interpreter is closing: the caller does it all
            while self._missing:
                _thread.start_new_thread(self._work, ())
                self._missing -= 1
        self._queue.put(shares)

    def _work(self) -> None:
        while (shares := self._queue.get()) is not None:
            for share in shares:
                share.work()
            del shares, share  # and with them the arrays

    def close(self) -> None:
        """Lets the threads go when the queue is done."""
        for _ in range(self._size):
            self._queue.put(None)


def _offer(shares: list[_Share[Any]]) -> None:
    global _pool
    with _lock:
        if _pool is None:
            _pool = _Pool(max(1, get_num_threads() - 1))
        _pool.offer(shares)


def _default_num_threads() -> int:
    text = os.environ.get("COLLIDE_NUM_THREADS")
    if text:
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

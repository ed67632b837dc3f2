"""One range, split over a pool of threads, for what Python has to do beside kernels: see _compile/team.py for the rest.

Kernels run without the GIL, so plain threads do, and have none of the faults of Numba's layers: `workqueue` aborts on
concurrent calls, `omp` kills a forked child. The caller works too, and takes over every share that nobody has begun:
where the workers are busy, or there are none to be had, a call is slower, never stuck.
"""

from __future__ import annotations

import _thread
import contextlib
import itertools
import threading
from collections import deque
from collections.abc import Callable, Iterator
from queue import SimpleQueue
from typing import Any, Generic, TypeVar

from . import locks, processors, settings
from .forks import at_fork

Result = TypeVar("Result")

# A large batch has _SHARES_A_THREAD shares a thread, a smaller one fewer, each of at least _LEAST_SHARE pairs. To wake
# a thread takes some 60 us on a virtual machine: with more shares than threads the caller works on until the others
# are there, and whoever is slowed down takes fewer. But each share means taking the GIL again, which beside a busy
# thread of pure Python can take 5 ms: not too many.
_LEAST_SHARE = 1 << 15
_SHARES_A_THREAD = 4
# At most so many invitations wait for workers. To accept one whose call has ended does nothing.
_UNREAD = 256
# Shares begin at multiples of this, so that all of them start on a cache line if the first does.
_GRAIN = 64

_local = threading.local()
_num_threads: int | None = None
_workers: list[object] = []
_invitations: SimpleQueue[_Invitation | None] = SimpleQueue()  # None: see whether you are still needed


def get_num_threads() -> int:
    """Get the number of threads that a large batch runs on, the caller's included.

    Returns
    -------
    int
        What `set_num_threads` was given last. At first it is the environment variable COLLIDE_NUM_THREADS, else the
        number of processors that the process may use: its affinity mask and its control group's quota count.

    Raises
    ------
    ValueError
        If the environment variable is no integer, or below 1.

    See Also
    --------
    set_num_threads : Change it.

    Examples
    --------
    >>> collide.get_num_threads() >= 1
    True
    """
    global _num_threads
    if _num_threads is None:
        _num_threads = _default_num_threads()
    return _num_threads


def set_num_threads(n: int) -> None:
    """Set the number of threads that a large batch runs on, for the whole process.

    Parameters
    ----------
    n : int
        At least 1, the caller's thread included. The result of a batch does not depend on it.

    Raises
    ------
    TypeError
        If it is no integer.
    ValueError
        If it is below 1.

    See Also
    --------
    get_num_threads : What it is now.

    Examples
    --------
    >>> collide.set_num_threads(2)
    >>> collide.get_num_threads()
    2
    """
    global _num_threads
    n = settings.integer("n", n, least=1, what="the number of threads ")
    _num_threads = n
    for _ in range(len(_workers) - (n - 1)):
        _invitations.put(None)


def is_shared(n: int, least: int) -> bool:
    """Whether n pairs, of which so many are worth two threads, may use more than the caller's."""
    return n >= least and get_num_threads() > 1 and not getattr(_local, "alone", False)


def is_worth_it(n: int, work: int = 1) -> bool:
    """Whether `run` would share them out."""
    return is_shared(n * work, 2 * _LEAST_SHARE)


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
    if not is_worth_it(n, work):
        return [task(0, n)]
    threads = get_num_threads()
    count = min(n * work // _LEAST_SHARE, _SHARES_A_THREAD * threads)
    cuts = [n * i // count // grain * grain for i in range(count)] + [n]
    shares = [_Share(task, start, stop) for start, stop in itertools.pairwise(cuts)]
    todo = deque(shares)
    invitations = [_Invitation(todo) for _ in range(min(threads, count) - 1)]
    # However often the call is interrupted, no thread may go on writing into its arrays when it has ended. Each of
    # these is one step of the interpreter, made ready before: an interrupt comes before or after it, and both are run.
    withdraw, wait = todo.clear, locks.waiting([i.lock for i in invitations])
    try:
        try:
            _invite(invitations)
            while todo and (share := _next(todo.popleft)):
                share.work()
        finally:
            withdraw()
    finally:
        wait()
        for invitation in invitations:
            invitation.leave()
    for share in shares:
        if share.error is not None:
            raise share.error
    return [share.result for share in shares]  # type: ignore[misc]


class _Share(Generic[Result]):
    """A part of the range, for whoever takes it from the list of what is to do."""

    __slots__ = "error", "range", "result", "task"

    def __init__(self, task: Callable[[int, int], Result], start: int, stop: int) -> None:
        self.task, self.range = task, (start, stop)
        self.result: Result | None = None
        self.error: BaseException | None = None

    def work(self) -> None:
        self.result = self.task(*self.range)


def _next(take: Callable[[], _Share[Result]]) -> _Share[Result] | None:
    """A share that nobody else will work on; None where the last has just been taken."""
    try:
        return take()
    except IndexError:
        return None


# An interrupt, a signal handler that calls and a finalizer that calls may come between any two steps. So nothing here
# is guarded by a lock, which they could leave taken or find taken by their own thread: there are only steps that are
# whole, of lists, of deques and of queues, and any order of them does.


class _Invitation:
    """To one worker, to help with what is to do.

    It has a lock, which the caller takes at the end of its call, after a wait for the worker: who has it may take
    shares, and nobody else. A worker may come when all is over, and find it taken; so no other call gets it before both
    have left.
    """

    def __init__(self, todo: deque[_Share[Any]]) -> None:
        self._todo, self.lock = todo, locks.take()
        self._other = [None]  # who is still to leave

    def accept(self) -> None:
        """What the worker does: from the other end, so that each thread's shares adjoin."""
        if not locks.acquire_at_once(self.lock):
            return self.leave()
        try:
            while self._todo and (share := _next(self._todo.pop)):
                try:
                    share.work()
                except BaseException as error:
                    share.error = error
        finally:
            self.leave()  # before the release, which wakes the caller, who would wait for the GIL
            locks.release(self.lock)
        return None

    def leave(self) -> None:
        """The caller leaves, and the worker or whoever found that there is none."""
        try:
            self._other.pop()
        except IndexError:
            locks.give_back(self.lock)


def _invite(invitations: list[_Invitation]) -> None:
    if len(_workers) < len(invitations):
        with contextlib.suppress(RuntimeError):  # out of threads, or the interpreter is closing: the caller does it all
            for _ in range(len(invitations) - len(_workers)):
                _thread.start_new_thread(_serve, ())
    for invitation in invitations:
        # Where nobody has come for so many others, nobody will soon.
        if _invitations.qsize() < _UNREAD + len(invitations):
            _invitations.put(invitation)
        else:
            invitation.leave()


def _serve() -> None:
    """The life of a worker."""
    coming, me = _invitations, object()
    _workers.append(me)
    try:
        # There may be too many: of several calls that start workers at once, each starts all that are missing.
        while _workers.index(me) < get_num_threads() - 1:
            if invitation := coming.get():
                invitation.accept()
            del invitation  # and with it the arrays
    finally:
        _workers.remove(me)


def _default_num_threads() -> int:
    given = settings.of_environment("COLLIDE_NUM_THREADS", least=1)
    return processors.available() if given is None else given


def _after_fork() -> None:
    """A forked child has none of the workers, and a queue that another thread may have been changing."""
    global _workers, _invitations
    _workers, _invitations = [], SimpleQueue()
    locks.after_fork()


at_fork(after_in_child=_after_fork)

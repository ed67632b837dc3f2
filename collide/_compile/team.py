"""The threads that kernels share, without the GIL: whoever is free takes the next piece of a kernel's range.

The threads wait in compiled code, and know nothing of Python: where each had to take the GIL, sixteen were no faster
than four, and two at 100,000 pairs no faster than one. Nor can an interrupt come between two steps of a kernel, so
nothing that is said below can be left half done.

A kernel offers its job to threads that have none, begins, and takes back what nobody has begun when there is no piece
left: where all are busy, or there are none to be had, a call is slower, never stuck. Then it waits for those that have
begun, as they write to its arrays, and read what stands on its stack.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from typing import Any

import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils

from .._system import locks, threads
from .._system.forks import at_fork
from .._typing import Array
from .arrays import address_of
from .kernel import Callback
from .lanes import I64, out_of_line
from .options import formula, intrinsic, rare
from .words import add_to, exchange, pause, seen, set_to, words

# Pairs that are worth two threads: where a virtual machine wakes one in 40 us, 50,000 in the plane take as long by one
# as by two; where it takes 10 us, 20,000 do.
LEAST = 3 << 14
_LEAST_PIECE = 1 << 12  # to take one costs as much as some ten pairs
_PIECES_A_THREAD = 16  # of a large range, so that all end nearly at once
_GRAIN = 64  # pieces begin at multiples of this, so that all of them start on a cache line if the first does
_MOST = 1 << 10  # threads in all
_SPINS = 2000  # looks before a thread goes to sleep: some 50 us, as much as it takes to wake one

# A job, in words on the stack of its kernel: the next pair that nobody has taken, how many a piece has, how many there
# are; what the pieces returned, in all; how many threads have been asked and have not left, and the lock for which the
# kernel waits if they are long; the threads, how many of them may have been asked, and the next that nobody has woken;
# a lock for what they write together; the code, and where its arguments are.
NEXT, SIZE, N, _FOUND, _INSIDE, _DONE, _TEAM, _ASKED, _WOKEN, _HELD, CODE, ARGUMENTS, JOB_END = range(13)
_SLEEPS = 1 << 32  # added to the number of those inside: the last of them wakes the kernel
# A team: how many threads a call may ask, and how many have begun. Of each, from a line of its own on: the job that it
# is offered, the lock for which it waits, and whether it has been woken: to release a lock that is free is an error on
# some systems. A seat, which a call takes: the team, and a lock that is taken.
_MAY_BE_ASKED, _BEGUN = range(2)
_JOB, _LOCK, _WOKEN_UP = range(3)
_LINE = 8
_IDLE, _BUSY = 0, 1  # instead of a job; busy as well is a place that has no thread


@formula
def _at(place: int, k: int) -> int:
    """The address of a word."""
    return place + 8 * k


def _lock_function(name: str, *more: int) -> Any:
    """One of Python's functions of locks, which need no GIL. Its further arguments are these."""

    def call(typingctx: Any, lock: Any) -> Any:
        def codegen(context: Any, b: Any, sig: Any, args: Any) -> Any:
            arguments = [b.inttoptr(args[0], cgutils.voidptr_t), *(ir.Constant(ir.IntType(32), k) for k in more)]
            kind = ir.FunctionType(ir.VoidType(), [a.type for a in arguments])
            b.call(cgutils.get_or_insert_function(b.module, kind, name), arguments)
            return context.get_dummy_value()

        return types.void(types.int64), codegen

    return intrinsic(call)


_acquire = _lock_function("PyThread_acquire_lock", 1)  # and waits for it
_release = _lock_function("PyThread_release_lock")


@intrinsic
def _new_lock(typingctx: Any) -> Any:
    """The address of one that is free; 0 where there is no memory."""

    def codegen(context: Any, b: Any, sig: Any, args: Any) -> Any:
        kind = ir.FunctionType(cgutils.voidptr_t, [])
        return b.ptrtoint(b.call(cgutils.get_or_insert_function(b.module, kind, "PyThread_allocate_lock"), []), I64)

    return types.int64(), codegen


def code_type(context: Any) -> Any:
    return context.call_conv.get_function_type(types.int64, (types.int64,))


@intrinsic
def _run(typingctx: Any, code: Any, job: Any) -> Any:
    """Runs the code of a job."""

    def codegen(context: Any, b: Any, sig: Any, args: Any) -> Any:
        kind = code_type(context)
        result, error = cgutils.alloca_once(b, I64), cgutils.alloca_once(b, kind.args[1].pointee)
        b.call(b.inttoptr(args[0], kind.as_pointer()), [result, error, args[1]])
        return b.load(result)

    return types.int64(types.int64, types.int64), codegen


@formula
def start(job: int, n: int, seat: int) -> int:
    """Runs a job."""
    w = words(job)
    w[NEXT], w[SIZE], w[N], w[_HELD] = 0, n, n, 0
    found: int = _together(job, n, seat) if seat != 0 else _run(w[CODE], job)
    return found


def _wake_two(job: int) -> None:
    """Wakes two of those that are asked; each of them does the same: the last of many is awake the sooner."""
    w = words(job)
    woken = 0
    while woken < 2:
        i = add_to(_at(job, _WOKEN), 1)
        if i >= w[_ASKED]:
            return
        place = _place(w[_TEAM], i)
        if seen(place) == job:
            woken += 1
            if exchange(_at(place, _WOKEN_UP), 0, 1):
                _release(words(place)[_LOCK])


formula(_wake_two)


@formula
def _place(team: int, i: int) -> int:
    """That of a thread."""
    return _at(team, _LINE * (i + 1))


@rare
def _together(job: int, n: int, seat: int) -> int:
    """Runs a job on this thread, and on others that have none."""
    out_of_line()
    w, team = words(job), words(seat)[0]
    n_threads = seen(_at(team, _MAY_BE_ASKED))
    helpers = max(0, min(n_threads, n // _LEAST_PIECE - 1))
    w[SIZE] = max(_LEAST_PIECE, n // (_PIECES_A_THREAD * (helpers + 1)) // _GRAIN * _GRAIN)
    w[_FOUND], w[_INSIDE], w[_DONE], w[_TEAM], w[_WOKEN] = 0, 0, words(seat)[1], team, 0
    w[_ASKED] = n_threads
    asked = 0
    for i in range(n_threads):
        if asked < helpers:
            add_to(_at(job, _INSIDE), 1)
            if exchange(_place(team, i), _IDLE, job):
                asked += 1
            else:
                add_to(_at(job, _INSIDE), -1)
    _wake_two(job)
    found = _run(w[CODE], job)
    for i in range(n_threads):
        if exchange(_place(team, i), job, _IDLE):
            add_to(_at(job, _INSIDE), -1)
    looks = 0
    while looks < _SPINS and seen(_at(job, _INSIDE)) != 0:
        pause()
        looks += 1
    if looks == _SPINS and add_to(_at(job, _INSIDE), _SLEEPS) != 0:
        _acquire(w[_DONE])
    if found >= 0:
        found += seen(_at(job, _FOUND))
    return int(found)


def _serve(team: int) -> None:
    """What a thread does, for ever: the jobs that it is offered at its place."""
    lock = _new_lock()
    i = add_to(_at(team, _BEGUN), 1) if lock != 0 else _MOST
    place = _place(team, i)
    if i < _MOST:
        _acquire(lock)
        words(place)[_LOCK] = lock
        set_to(place, _IDLE)
    while i < _MOST:
        _acquire(lock)
        set_to(_at(place, _WOKEN_UP), 0)
        job = seen(place)
        # It may have been taken back, and its stack may be another's by now: to be looked at when it is ours.
        if job != _IDLE and exchange(place, job, _BUSY):
            _wake_two(job)
            w = words(job)
            add_to(_at(job, _FOUND), _run(w[CODE], job))
            done = w[_DONE]
            set_to(place, _IDLE)
            if add_to(_at(job, _INSIDE), -1) == _SLEEPS + 1:
                _release(done)


@formula
def hold(job: int) -> None:
    """Keeps the other threads of a job from what it writes for all, until `let_go`."""
    while not exchange(_at(job, _HELD), 0, 1):
        pause()


@formula
def let_go(job: int) -> None:
    set_to(_at(job, _HELD), 0)


_SERVE = Callback(_serve, types.void(types.int64), "serve")
# By C: what starts Python's threads may be another's, as gevent's, whose threads would wait for ever for this one.
_start_thread = ctypes.PYFUNCTYPE(ctypes.c_ulong, ctypes.c_void_p, ctypes.c_void_p)(
    ("PyThread_start_new_thread", ctypes.pythonapi)
)
_FAILED = ctypes.c_ulong(-1).value


class _Team:
    """The threads of this process, and the seats that calls have left.

    An interrupt, or another caller, may come between any two of Python's steps: what a thread needs it makes itself.
    """

    def __init__(self) -> None:
        self._memory = np.full(_LINE * (_MOST + 1), 0)
        self._memory[_LINE::_LINE] = _BUSY
        self._address = address_of(self._memory)
        self._started = 0
        self._spare: list[tuple[int, Array]] = []
        # The threads may look at it when the interpreter is already at its end.
        ctypes.pythonapi.Py_IncRef(ctypes.py_object((self._memory, _SERVE)))

    @property
    def size(self) -> int:
        """How many threads have begun."""
        return int(self._memory[_BEGUN])

    def seat(self, n: int) -> tuple[int, Array]:
        """A seat for a call of n pairs, by its address, and the threads that it is worth."""
        wanted = min(threads.get_num_threads() - 1, _MOST)
        while self._started < min(wanted, n // _LEAST_PIECE - 1):
            if _start_thread(_SERVE.compiled, self._address) == _FAILED:  # out of threads
                break
            self._started += 1
        self._memory[_MAY_BE_ASKED] = min(self.size, wanted)
        try:
            return self._spare.pop()
        except IndexError:
            lock = locks.take()
            locks.acquire_at_once(lock)
            seat = np.array([self._address, lock])
            return address_of(seat), seat

    def leave(self, seat: tuple[int, Array]) -> None:
        """The call has ended."""
        self._spare.append(seat)


_the = _Team()


def together(kernel: Callable[[int], int], n: int) -> int:
    """kernel(seat), of n pairs, on all threads."""
    team = _the
    seat = team.seat(n)
    try:
        return kernel(seat[0])
    finally:
        team.leave(seat)


def _after_fork() -> None:
    """A forked child has none of the threads."""
    global _the
    _the = _Team()


at_fork(after_in_child=_after_fork)

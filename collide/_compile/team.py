"""One kernel on several threads, without the GIL: whoever is free takes the next piece of its range.

Python's threads lend themselves. They wait in compiled code, and a call needs none of Python's steps from them: where
each had to take the GIL, sixteen threads were no faster than four, and two at 100,000 pairs no faster than one. While
it waits a kernel cannot be interrupted, so nothing that is said below can be left half done.

A kernel offers its job to threads that have none, begins, and takes back what nobody has begun when there is no piece
left: where all are busy, or there are none to be had, a call is slower, never stuck. Then it waits for those that have
begun, as they write to its arrays, and read what stands on its stack.
"""

from __future__ import annotations

import _thread
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
from .kernel import Kernel
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
_NEXT, _SIZE, _N, _FOUND, _INSIDE, _DONE, _TEAM, _ASKED, _WOKEN, _HELD, _CODE, _ARGUMENTS, _JOB_END = range(13)
_SLEEPS = 1 << 32  # added to the number of those inside: the last of them wakes the kernel
# A team: how many threads it has, and of each, from a line of its own on, the job that it is offered and the lock for
# which it waits. A seat, which a call takes: the team, and a lock that is taken.
_IDLE, _BUSY = 0, 1  # instead of a job
_LINE = 8

Function = Callable[..., int]


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
def _new_job(typingctx: Any) -> Any:
    """The address of words on the stack."""

    def codegen(context: Any, b: Any, sig: Any, args: Any) -> Any:
        with b.goto_entry_block():
            place = b.alloca(ir.ArrayType(I64, _JOB_END))
        return b.ptrtoint(place, I64)

    return types.int64(), codegen


def _code_type(context: Any) -> Any:
    return context.call_conv.get_function_type(types.int64, (types.int64,))


@intrinsic
def _prepare(typingctx: Any, work: Any, function: Any, arguments: Any, job: Any) -> Any:
    """Makes work(function, arguments, job) the code of a job, which any thread can run by its address."""
    called = work.get_call_type(typingctx, (function, arguments, types.int64), {})

    def codegen(context: Any, b: Any, sig: Any, args: Any) -> Any:
        given = args[2]
        with b.goto_entry_block():
            place = b.alloca(given.type)
        b.store(given, place)
        code = ir.Function(b.module, _code_type(context), b.module.get_unique_name(b.function.name + ".job"))
        code.linkage = "internal"
        code.attributes.add("noinline")  # there is one copy of the loop
        inner = ir.IRBuilder(code.append_basic_block("entry"))
        (its_job,) = context.call_conv.get_arguments(code)
        its_words = inner.inttoptr(its_job, I64.as_pointer())
        at = inner.load(inner.gep(its_words, [ir.Constant(I64, _ARGUMENTS)]))
        its_arguments = inner.load(inner.inttoptr(at, given.type.as_pointer()))
        result = context.get_function(work, called)(inner, [context.get_dummy_value(), its_arguments, its_job])
        context.call_conv.return_value(inner, result)
        to = b.inttoptr(args[3], I64.as_pointer())
        b.store(b.ptrtoint(code, I64), b.gep(to, [ir.Constant(I64, _CODE)]))
        b.store(b.ptrtoint(place, I64), b.gep(to, [ir.Constant(I64, _ARGUMENTS)]))
        return context.get_dummy_value()

    return types.void(work, function, arguments, types.int64), codegen


@intrinsic
def _run(typingctx: Any, code: Any, job: Any) -> Any:
    """Runs the code of a job."""

    def codegen(context: Any, b: Any, sig: Any, args: Any) -> Any:
        kind = _code_type(context)
        result, error = cgutils.alloca_once(b, I64), cgutils.alloca_once(b, kind.args[1].pointee)
        b.call(b.inttoptr(args[0], kind.as_pointer()), [result, error, args[1]])
        return b.load(result)

    return types.int64(types.int64, types.int64), codegen


@formula
def in_pieces(function: Function, arguments: Any, n: int, seat: int) -> int:
    """The sum of function(start, stop, job, *arguments) over pieces that make up range(n).

    `seat`: that of the call, 0 if it shall stay on its thread.
    """
    job = _new_job()
    w = words(job)
    w[_NEXT], w[_SIZE], w[_N], w[_HELD] = 0, n, n, 0
    _prepare(_work, function, arguments, job)
    found: int = _together(job, n, seat) if seat != 0 else _run(w[_CODE], job)
    return found


def _work(function: Function, arguments: Any, job: int) -> int:
    """What each thread does: pieces, until there is none left."""
    w = words(job)
    size, n, found = w[_SIZE], w[_N], 0
    start = add_to(_at(job, _NEXT), size)
    while start < n:
        found += function(start, min(start + size, n), job, *arguments)
        start = add_to(_at(job, _NEXT), size)
    return found


def _wake_two(job: int) -> None:
    """Wakes two of those that are asked; each of them does the same: the last of many is awake the sooner."""
    w = words(job)
    woken = 0
    while woken < 2:
        i = add_to(_at(job, _WOKEN), 1)
        if i >= w[_ASKED]:
            return
        place = _at(w[_TEAM], _LINE * (i + 1))
        if seen(place) == job:
            _release(words(place)[1])
            woken += 1


for _function in (_work, _wake_two):
    formula(_function)


@rare
def _together(job: int, n: int, seat: int) -> int:
    """Runs a job on this thread, and on others that have none."""
    out_of_line()
    w, team = words(job), words(seat)[0]
    n_threads = seen(team)
    helpers = min(n_threads, n // _LEAST_PIECE - 1)
    w[_SIZE] = max(_LEAST_PIECE, n // (_PIECES_A_THREAD * (helpers + 1)) // _GRAIN * _GRAIN)
    w[_FOUND], w[_INSIDE], w[_DONE], w[_TEAM], w[_WOKEN] = 0, 0, words(seat)[1], team, 0
    w[_ASKED] = n_threads
    asked = 0
    for i in range(n_threads):
        if asked < helpers:
            add_to(_at(job, _INSIDE), 1)
            if exchange(_at(team, _LINE * (i + 1)), _IDLE, job):
                asked += 1
            else:
                add_to(_at(job, _INSIDE), -1)
    _wake_two(job)
    found = _run(w[_CODE], job)
    for i in range(n_threads):
        if exchange(_at(team, _LINE * (i + 1)), job, _IDLE):
            add_to(_at(job, _INSIDE), -1)
    looks = 0
    while looks < _SPINS and seen(_at(job, _INSIDE)) != 0:
        pause()
        looks += 1
    if looks == _SPINS and add_to(_at(job, _INSIDE), _SLEEPS) != 0:
        _acquire(w[_DONE])
    found += seen(_at(job, _FOUND))
    return int(found)


def _serve(place: int) -> None:
    """What a thread of the team does, for ever: the jobs that it is offered at its place."""
    while True:
        _acquire(words(place)[1])
        job = seen(place)
        # It may have been taken back, and its stack may be another's by now: to be looked at when it is ours.
        if job != _IDLE and exchange(place, job, _BUSY):
            _wake_two(job)
            w = words(job)
            add_to(_at(job, _FOUND), _run(w[_CODE], job))
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


_SERVE = Kernel(_serve, types.void(types.int64), "serve")


class _Team:
    """The threads of this process, and the seats that calls have left."""

    def __init__(self) -> None:
        self._memory = np.zeros(_LINE * (_MOST + 1), np.int64)
        # Its threads may look at it when the interpreter is already at its end.
        ctypes.pythonapi.Py_IncRef(ctypes.py_object(self._memory))
        self._address: int = self._memory.ctypes.data
        self._places = list(range(_MOST, 0, -1))  # without a thread
        self._spare: list[Array] = []

    @property
    def size(self) -> int:
        return _MOST - len(self._places)

    def seat(self) -> Array:
        """A seat for a call, with all threads that the user wants behind it."""
        wanted = min(threads.get_num_threads() - 1, _MOST)
        while self.size < wanted and self._is_started():
            pass
        self._memory[0] = min(self.size, wanted)
        try:
            return self._spare.pop()
        except IndexError:
            lock = locks.take()
            locks.acquire_at_once(lock)
            return np.array([self._address, lock])

    def leave(self, seat: Array) -> None:
        """The call has ended."""
        self._spare.append(seat)

    def _is_started(self) -> bool:
        """Whether one more thread could be started."""
        serve, place = _SERVE.compiled, self._places.pop()
        self._memory[_LINE * place + 1] = lock = locks.take()
        locks.acquire_at_once(lock)
        try:
            _thread.start_new_thread(serve, (self._address + 8 * _LINE * place,))
        except RuntimeError:  # out of threads, or the interpreter is closing
            self._places.append(place)
            locks.give_back(lock)
            return False
        return True


_the = _Team()


def together(kernel: Callable[[int], int]) -> int:
    """kernel(seat) on all threads."""
    team = _the
    seat = team.seat()
    try:
        return kernel(seat.ctypes.data)
    finally:
        team.leave(seat)


def _after_fork() -> None:
    """A forked child has none of the threads."""
    global _the
    _the = _Team()


at_fork(after_in_child=_after_fork)

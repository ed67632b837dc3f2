"""One kernel on several threads, without the GIL: whoever is free takes the next piece of its range.

The threads wait in compiled code, and know nothing of Python: where each had to take the GIL, sixteen were no faster
than four, and two at 100,000 pairs no faster than one. Nor can an interrupt come between two steps of a kernel, so
nothing that is said below can be left half done.

A kernel offers its job to threads that have none, begins, and takes back what nobody has begun when there is no piece
left: where all are busy, or there are none to be had, a call is slower, never stuck. Then it waits for those that have
begun, as they write to its arrays, and read what stands on its stack.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Iterator
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
_NEXT, _SIZE, _N, _FOUND, _INSIDE, _DONE, _TEAM, _ASKED, _WOKEN, _HELD, _CODE, _ARGUMENTS, _JOB_END = range(13)
_SLEEPS = 1 << 32  # added to the number of those inside: the last of them wakes the kernel
# A team: how many threads a call may ask, and how many have begun. Of each, from a line of its own on: the job that it
# is offered, the lock for which it waits, and whether it has been woken: to release a lock that is free is an error on
# some systems. A seat, which a call takes: the team, and a lock that is taken.
_MAY_BE_ASKED, _BEGUN = range(2)
_JOB, _LOCK, _WOKEN_UP = range(3)
_LINE = 8
_IDLE, _BUSY = 0, 1  # instead of a job; busy as well is a place that has no thread

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
def _new_lock(typingctx: Any) -> Any:
    """The address of one that is free; 0 where there is no memory."""

    def codegen(context: Any, b: Any, sig: Any, args: Any) -> Any:
        kind = ir.FunctionType(cgutils.voidptr_t, [])
        return b.ptrtoint(b.call(cgutils.get_or_insert_function(b.module, kind, "PyThread_allocate_lock"), []), I64)

    return types.int64(), codegen


def _code_type(context: Any) -> Any:
    return context.call_conv.get_function_type(types.int64, (types.int64,))


def _taken_apart(context: Any, b: Any, kind: Any, value: Any) -> list[Any]:
    """The values that a job needs of its arguments; of an array not all seven."""
    if isinstance(kind, types.BaseTuple):
        parts = zip(kind.types, cgutils.unpack_tuple(b, value), strict=True)
        return [leaf for its_kind, part in parts for leaf in _taken_apart(context, b, its_kind, part)]
    if isinstance(kind, types.Array):
        array = context.make_array(kind)(context, b, value)
        return [array.data, array.nitems, *cgutils.unpack_tuple(b, array.strides), array.parent]
    return [] if isinstance(kind, types.Callable) else [value]


def _put_together(context: Any, b: Any, kind: Any, leaves: Iterator[Any]) -> Any:
    """The reverse."""
    if isinstance(kind, types.BaseTuple):
        return context.make_tuple(b, kind, [_put_together(context, b, part, leaves) for part in kind.types])
    if isinstance(kind, types.Array):
        array = context.make_array(kind)(context, b)
        array.data, array.nitems, stride, array.parent = (next(leaves) for _ in range(4))
        array.shape, array.strides = cgutils.pack_array(b, [array.nitems]), cgutils.pack_array(b, [stride])
        array.itemsize = ir.Constant(array.itemsize.type, kind.dtype.bitwidth // 8)
        array.meminfo = cgutils.get_null_value(array.meminfo.type)
        return array._getvalue()
    return context.get_dummy_value() if isinstance(kind, types.Callable) else next(leaves)


@intrinsic
def _run(typingctx: Any, code: Any, job: Any) -> Any:
    """Runs the code of a job."""

    def codegen(context: Any, b: Any, sig: Any, args: Any) -> Any:
        kind = _code_type(context)
        result, error = cgutils.alloca_once(b, I64), cgutils.alloca_once(b, kind.args[1].pointee)
        b.call(b.inttoptr(args[0], kind.as_pointer()), [result, error, args[1]])
        return b.load(result)

    return types.int64(types.int64, types.int64), codegen


@intrinsic
def in_pieces(typingctx: Any, look: Any, function: Any, arguments: Any, n: Any, seat: Any) -> Any:
    """The sum of function(start, stop, job, facts, *arguments) over pieces that make up range(n).

    look(*arguments) gives the facts, and whether the arguments are refused: then nothing is done, and -1 returned.
    Each thread looks itself, as to hand over what it has seen, or a dozen arrays once more, takes longer. The arguments
    are numbers, arrays of one dimension, functions, and tuples of these. `seat`: that of the call, 0 if it shall stay
    on its thread.

    What every thread runs is emitted as a function of its own, known by its address. Not by Numba, which optimises all
    code once more for each function around it:

        facts, is_refused = look(*arguments)
        start = n if is_refused else 0 if size >= n else add_to(next, size)
        while start < n:
            found += function(start, min(start + size, n), job, facts, *arguments)
            start = n if size >= n else add_to(next, size)
        return -1 if is_refused else found
    """
    looks = look.get_call_type(typingctx, arguments.types, {})
    piece = types.int64, types.int64, types.int64, looks.return_type[0], *arguments.types
    works = function.get_call_type(typingctx, piece, {})
    starts = typingctx.resolve_value_type(_start).get_call_type(typingctx, (types.int64,) * 3, {})

    def emit(context: Any, i: Any, struct: Any) -> None:
        (job,) = context.call_conv.get_arguments(i.function)
        w = i.inttoptr(job, I64.as_pointer())
        from_there = i.inttoptr(i.load(cgutils.gep(i, w, _ARGUMENTS)), struct.as_pointer())
        leaves = (i.load(cgutils.gep_inbounds(i, from_there, 0, k)) for k in range(len(struct.elements)))
        given = cgutils.unpack_tuple(i, _put_together(context, i, arguments, leaves))
        facts, is_refused = cgutils.unpack_tuple(i, context.get_function(look, looks)(i, given))
        size, n = (i.load(cgutils.gep(i, w, k)) for k in (_SIZE, _N))
        nothing = ir.Constant(I64, 0)
        alone, place = i.icmp_signed(">=", size, n), i.ptrtoint(cgutils.gep(i, w, _NEXT), I64)

        def take(otherwise: Any) -> Any:
            """The next piece; alone there is none but the first."""
            before, atomic, taken = i.block, i.append_basic_block("take"), i.append_basic_block("taken")
            i.cbranch(alone, taken, atomic)
            i.position_at_end(atomic)
            theirs = i.atomic_rmw("add", i.inttoptr(place, I64.as_pointer()), size, "seq_cst")
            i.branch(taken)
            i.position_at_end(taken)
            phi = i.phi(I64)
            phi.add_incoming(otherwise, before)
            phi.add_incoming(theirs, atomic)
            return phi

        begin, loop, end = (i.append_basic_block(name) for name in ("begin", "loop", "end"))
        before = i.block
        i.cbranch(context.is_true(i, types.boolean, is_refused), end, begin)
        i.position_at_end(begin)
        first = take(nothing)
        first_block = i.block
        i.branch(loop)
        i.position_at_end(loop)
        start, found = i.phi(I64), i.phi(I64)
        body = i.append_basic_block("body")
        i.cbranch(i.icmp_signed("<", start, n), body, end)
        i.position_at_end(body)
        beyond = i.add(start, size)
        stop = i.select(i.icmp_signed("<", beyond, n), beyond, n)
        its = context.get_function(function, works)(i, [start, stop, job, facts, *given])
        more = i.add(found, context.cast(i, its, works.return_type, types.int64))
        following = take(n)
        for phi, value, again in ((start, first, following), (found, nothing, more)):
            phi.add_incoming(value, first_block)
            phi.add_incoming(again, i.block)
        i.branch(loop)
        i.position_at_end(end)
        result = i.phi(I64)
        result.add_incoming(ir.Constant(I64, -1), before)
        result.add_incoming(found, loop)
        context.call_conv.return_value(i, result)

    def codegen(context: Any, b: Any, sig: Any, args: Any) -> Any:
        leaves = _taken_apart(context, b, arguments, args[2])
        struct = ir.LiteralStructType([leaf.type for leaf in leaves])
        with b.goto_entry_block():
            place, job = b.alloca(struct), b.alloca(I64, _JOB_END)
        for k, leaf in enumerate(leaves):
            b.store(leaf, cgutils.gep_inbounds(b, place, 0, k))
        code = ir.Function(b.module, _code_type(context), b.module.get_unique_name(b.function.name + ".job"))
        code.linkage = "internal"
        code.attributes.add("noinline")  # there is one copy of the loop
        emit(context, ir.IRBuilder(code.append_basic_block("entry")), struct)
        b.store(b.ptrtoint(code, I64), cgutils.gep(b, job, _CODE))
        b.store(b.ptrtoint(place, I64), cgutils.gep(b, job, _ARGUMENTS))
        start = context.get_function(typingctx.resolve_value_type(_start), starts)
        return start(b, [b.ptrtoint(job, I64), *args[3:]])

    return types.int64(look, function, arguments, types.int64, types.int64), codegen


@formula
def _start(job: int, n: int, seat: int) -> int:
    """Runs a job."""
    w = words(job)
    w[_NEXT], w[_SIZE], w[_N], w[_HELD] = 0, n, n, 0
    found: int = _together(job, n, seat) if seat != 0 else _run(w[_CODE], job)
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
    w[_SIZE] = max(_LEAST_PIECE, n // (_PIECES_A_THREAD * (helpers + 1)) // _GRAIN * _GRAIN)
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
    found = _run(w[_CODE], job)
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

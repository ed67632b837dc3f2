"""Batch loops under one fixed signature, compiled at their first call, by a thread of their own, and kept on disk."""

from __future__ import annotations

import _thread
import atexit
import contextlib
import itertools
import sys
import threading
from collections.abc import Callable, Sequence
from typing import Any

import numba
import numpy as np
from numba import types
from numba.core import config
from numba.core.compiler_lock import global_compiler_lock

from .._system import locks
from .._system.forks import at_fork
from .cache import DiskCache
from .options import batch_loop, callback


def spread(name: str, function: Callable[..., Any], lengths: Sequence[int], *before: Any) -> Callable[..., Any]:
    """function(*before, ...) with an argument for each element of its tuples; lengths: of each, 0 for no tuple.

    A kernel takes arrays one by one, as Numba knows their types at once. Of a tuple it asks Python for the type of
    every new mix of writable and read-only arrays, in the middle of a call (test_a_call_asks_python_for_no_types).
    The name becomes that of the machine code, where no two kernels may have the same, and Numba loads what is of a
    module only (test_nothing_is_compiled_twice). What comes before is written out here, as one more function around
    the loop would be optimised as a whole once more, which takes a tenth of the time to compile.
    """
    names = [[f"_{i}_{k}" for k in range(max(length, 1))] for i, length in enumerate(lengths)]
    given = [f"({', '.join(group)},)" if length else group[0] for group, length in zip(names, lengths, strict=True)]
    scope: dict[str, Any] = {"function": function, "__name__": __name__}
    scope.update({f"before_{k}": value for k, value in enumerate(before)})
    called = ", ".join([*(f"before_{k}" for k in range(len(before))), *given])
    exec(f"def _{name}({', '.join(itertools.chain(*names))}): return function({called})", scope)
    return scope[f"_{name}"]  # type: ignore[no-any-return]


KERNELS: list[Kernel] = []  # all that the modules imported so far have


class Kernel:
    """A compiled batch loop: one signature, made when it is first called, run without the GIL.

    One signature only, because Numba's own index of signatures can be poisoned by two processes that write it at once.
    """

    def __init__(self, function: Callable[..., Any], signature: Any, name: str) -> None:
        self._function, self._signature, self.name = function, signature, name
        self.cache = DiskCache(name)
        self._error: BaseException | None = None
        self._waiting: list[_thread.LockType] = []
        KERNELS.append(self)

    def __getattr__(self, name: str) -> Any:
        if name == "compiled":  # which is an attribute from then on: a property costs a small call 2 % of its time
            return self._made()
        raise AttributeError(name)

    @property
    def _is_made(self) -> bool:
        return "compiled" in self.__dict__

    def _made(self) -> Callable[..., Any]:
        """The kernel, made by a thread of its own.

        An interrupt in the middle of Numba or LLVM can leave either unusable, and Python delivers interrupts to the
        main thread only. The caller's wait may be interrupted; the thread goes on, and the next call waits for it.
        """
        if config.DISABLE_JIT:
            raise RuntimeError(
                "the batch functions of collide need Numba's compiler, and NUMBA_DISABLE_JIT is set; "
                "the formulas of collide.scalar work without it"
            )
        # A finalizer may call while its own thread makes a kernel, or compiles, and must not wait for itself.
        makes = _thread.get_ident() in _under_way or global_compiler_lock.is_locked()
        # Nor for a thread that the end of the interpreter leaves no time to.
        makes = makes or sys.is_finalizing()
        if makes or 0 < threading.stack_size() < _STACK:
            self._make()
        else:
            self._wait_for_maker()
        if not self._is_made:
            assert self._error is not None
            raise self._error
        return self.compiled  # type: ignore[no-any-return]

    def _wait_for_maker(self) -> None:
        done = _thread.allocate_lock()
        done.acquire()
        self._waiting.append(done)  # before the look at what there is: see the end of _work
        if not self._is_made and self not in list(_under_way.values()):
            lock = locks.take()
            locks.acquire_at_once(lock)
            _makers.append(lock)
            try:
                _thread.start_new_thread(self._work, (lock,))
            except RuntimeError:  # out of threads, or the interpreter is closing
                locks.release(lock)
                return self._make()
        if not self._is_made:
            done.acquire()
        return None

    def _work(self, lock: locks.Lock) -> None:
        """What the thread does."""
        _under_way[_thread.get_ident()] = self
        try:
            self._make()
        except BaseException as error:
            self._error = error
        finally:
            # In this order: whoever finds it under way is among those who are waiting.
            del _under_way[_thread.get_ident()]
            # Two may make it at once, where a second thread has been started before the first was under way.
            with contextlib.suppress(IndexError):
                while True:
                    self._waiting.pop().release()
            locks.release(lock)

    def _make(self) -> None:
        with global_compiler_lock:  # and no other lock: see the fork below
            if not self._is_made:
                self.compiled = self._build()

    def _build(self) -> Any:
        dispatcher = batch_loop(self._function)
        dispatcher._cache = self.cache
        dispatcher.compile(self._signature)
        dispatcher.disable_compile()
        _introduce(dispatcher, self._signature)
        return dispatcher


class Callback(Kernel):
    """A compiled function for C code: `compiled` is its address."""

    def _build(self) -> Any:
        made = callback(self._function, self._signature)
        made._cache = self.cache
        made.compile()
        self._made_of = made  # or its code might go
        return made.address


def _introduce(dispatcher: Any, signature: Any) -> None:
    """Shows a dispatcher arguments of its types, writable and not, with and without gaps.

    When it meets a type for the first time it asks Python what it is and what it converts to, and takes an interrupt
    that comes just then for a type that has no kernel. So all are met here, in calls that one None keeps from running.
    """
    for writable, step in itertools.product((True, False), (1, 2)):
        arguments: list[Any] = []
        for kind in signature.args:
            if isinstance(kind, types.Array):
                array = np.empty((3,) * kind.ndim, numba.np.numpy_support.as_dtype(kind.dtype))
                arguments.append(array[::step] if kind.layout == "A" else array)
                arguments[-1].flags.writeable = writable
            else:
                arguments.append(False if kind == types.boolean else 0.0 if kind == types.float64 else 0)
        dispatcher._search_new_conversions(*arguments)
        arguments[0 if writable else -1] = None
        with contextlib.suppress(TypeError):
            dispatcher(*arguments)
    # There is no other: what it calls for the rest is a TypeError without a step of Python's. In its own, which look
    # types up in dictionaries, an interrupt becomes a KeyError (test_no_interrupt_is_lost).
    dispatcher._search_new_conversions = "".format


_STACK = 1 << 23  # bytes that Numba and LLVM may need; a program may have asked for smaller threads
_under_way: dict[int, Kernel] = {}  # what threads make, by the thread
_makers: list[locks.Lock] = []  # of the threads that have made kernels, each held until it is done
# At exit the interpreter waits for threads that compile. What is registered last runs first, so this comes before
# Numba's own; `_makers` is read then.
atexit.register(locks.waiting(_makers))

# A child forked in the middle of a compilation would wait for a thread that it does not have. So the fork waits.
at_fork(
    before=global_compiler_lock.acquire,
    after_in_parent=global_compiler_lock.release,
    after_in_child=global_compiler_lock.release,
)
# Nor has it a thread that was about to begin.
at_fork(after_in_child=_makers.clear)
at_fork(after_in_child=_under_way.clear)

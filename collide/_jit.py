"""The one place where compile options and caching are decided.

`formula` marks a function of one pair: plain Python when Python calls it, compiled when any `@njit` code does.
`Kernel` is a batch loop under one fixed signature, compiled at its first call and kept on disk.
"""

from __future__ import annotations

import _thread
import atexit
import contextlib
import hashlib
import importlib.metadata
import os
import pickle
import sys
import tempfile
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import numba
import numpy as np
from numba import types
from numba.core import config
from numba.core.caching import NullCache
from numba.core.compiler import CompileResult
from numba.core.compiler_lock import global_compiler_lock
from numba.core.serialize import dumps
from numba.extending import overload, register_jitable

from . import _locks

Function = TypeVar("Function", bound=Callable[..., Any])

# error_model="python", Numba's default, tests every divisor and keeps a loop with a division scalar.
# fastmath stays off, said aloud because a callee inherits what it leaves open from its caller: contraction alone would
# end the bit equality with NumPy, and gains nothing at memory speed (test_reproducible.py holds the bits).
_OPTIONS = {"error_model": "numpy", "boundscheck": False, "fastmath": False}
# With Numba's run time the arrays and records that a function is given are counted up and down at every step of a loop.
_UNCOUNTED = {**_OPTIONS, "_nrt": False}
_INLINE = {**_UNCOUNTED, "forceinline": True}
_OUT_OF_LINE = {**_UNCOUNTED, "forceinline": False}


def formula(function: Function) -> Function:
    """Plain Python when Python calls it; in compiled code, part of what calls it."""
    register_jitable(**_INLINE)(function)
    return function


def rare(function: Function) -> Function:
    """As `formula`, but called: for what is long and seldom run, and would crowd the registers of a loop."""
    register_jitable(**_OUT_OF_LINE)(function)
    return function


def compiles(function: Callable[..., Any], *, inline: bool = True) -> Callable[[Function], Function]:
    """Marks the function that picks, by the argument types, what `function` is in compiled code."""

    def mark(pick: Function) -> Function:
        overload(function, jit_options=_INLINE if inline else _OUT_OF_LINE, strict=False)(pick)
        return pick

    return mark


def intrinsic(function: Callable[..., Any]) -> Any:
    """Numba's, for code that has no Python form: it gives a signature and emits LLVM."""
    return numba.extending.intrinsic(function)


class Kernel:
    """A compiled batch loop: one signature, made when it is first called, run without the GIL.

    One signature only, because Numba's own index of signatures can be poisoned by two processes that write it at once.
    """

    def __init__(self, function: Callable[..., Any], signature: Any, name: str) -> None:
        self._function, self._signature, self._name = function, signature, name
        self._compiled: Callable[..., Any] | None = None

    @property
    def compiled(self) -> Callable[..., Any]:
        return self._compiled or self._made()

    def _made(self) -> Callable[..., Any]:
        """The kernel, made by a thread of its own.

        An interrupt in the middle of Numba or LLVM can leave either unusable, and Python delivers interrupts to the
        main thread only. The caller's wait may be interrupted; the thread goes on, and the next call waits again.
        """
        if config.DISABLE_JIT:
            raise RuntimeError(
                "the batch functions of collide need Numba's compiler, and NUMBA_DISABLE_JIT is set; "
                "the formulas of collide.scalar work without it"
            )
        # A finalizer may call while its own thread compiles, and holds the lock that the other thread would wait for.
        if global_compiler_lock.is_locked() or not self._make_elsewhere():
            self._make()
        assert self._compiled is not None
        return self._compiled

    def _make_elsewhere(self) -> bool:
        """Whether a thread could be had for it, which has made the kernel by then, or raised what is raised here."""
        if 0 < threading.stack_size() < _STACK:
            return False
        done, errors, lock = _thread.allocate_lock(), [], _locks.take()
        done.acquire()
        _locks.acquire_at_once(lock)

        def work() -> None:
            try:
                self._make()
            except BaseException as error:
                errors.append(error)
            finally:
                done.release()
                _locks.release(lock)

        _makers.append(lock)
        try:
            _thread.start_new_thread(work, ())
        except RuntimeError:  # out of threads, or the interpreter is closing
            _locks.release(lock)
            return False
        done.acquire()
        if errors:
            raise errors[0]
        return True

    def _make(self) -> None:
        with global_compiler_lock:  # and no other lock: see the fork below
            if self._compiled is None:
                dispatcher = numba.njit(**_UNCOUNTED, nogil=True)(self._function)
                dispatcher._cache = _DiskCache(self._name)
                dispatcher.compile(self._signature)
                dispatcher.disable_compile()
                _introduce(dispatcher, self._signature)
                self._compiled = dispatcher


def _introduce(dispatcher: Any, signature: Any) -> None:
    """Shows a dispatcher arguments of its types, writable and not.

    When it meets a type for the first time it asks Python what it is and what it converts to, and takes an interrupt
    that comes just then for a type that has no kernel. So all are met here, in calls that one None keeps from running.
    """
    for writable in (True, False):
        arguments: list[Any] = []
        for kind in signature.args:
            if isinstance(kind, types.Array):
                arguments.append(np.empty((0,) * kind.ndim, numba.np.numpy_support.as_dtype(kind.dtype)))
                arguments[-1].flags.writeable = writable
            else:
                arguments.append(False if kind == types.boolean else 0.0 if kind == types.float64 else 0)
        dispatcher._search_new_conversions(*arguments)
        arguments[0 if writable else -1] = None
        with contextlib.suppress(TypeError):
            dispatcher(*arguments)


_STACK = 1 << 23  # bytes that Numba and LLVM may need; a program may have asked for smaller threads
_makers: list[_locks.Lock] = []  # of the threads that have made kernels, each held until it is done
# The interpreter must not go from under the compiler, however often it is told to. Registered after Numba's own, this
# comes first.
atexit.register(_locks.waiting(_makers))

if hasattr(os, "register_at_fork"):
    # A child forked in the middle of a compilation would wait for a thread that it does not have. So the fork waits.
    os.register_at_fork(
        before=global_compiler_lock.acquire,
        after_in_parent=global_compiler_lock.release,
        after_in_child=global_compiler_lock.release,
    )
    os.register_at_fork(after_in_child=_makers.clear)


class _DiskCache(NullCache):  # type: ignore[misc]
    """Compiled kernels on disk, a file each, named by a digest of everything that could change the machine code.

    Numba's own cache looks at one source file only and so serves stale code after an edit of a helper elsewhere. Here
    the name covers every source file of the package, the versions below it, the processor and the options: what is
    stale is never looked up. A damaged file fails its checksum and is compiled anew; nothing writable, nothing kept.
    """

    def __init__(self, name: str) -> None:
        self._name = name

    def _path(self, folder: Path, signature: Any, codegen: Any) -> Path:
        key = (signature, codegen.magic_tuple(), _environment(), _SOURCES)
        return folder / f"{self._name}-{hashlib.sha256(repr(key).encode()).hexdigest()[:32]}.nbc"

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        target_context.refresh()
        for folder in _folders() if _SOURCES else []:
            # Whatever is wrong with a file, its kernel is compiled anew: a cache never decides whether a call works.
            with contextlib.suppress(Exception):
                data = self._path(folder, sig, target_context.codegen()).read_bytes()
                if hashlib.sha256(data[32:]).digest() == data[:32]:
                    return CompileResult._rebuild(target_context, *pickle.loads(data[32:]))
        return None

    def save_overload(self, sig: Any, data: Any) -> None:
        if not _SOURCES or _sources_digest() != _SOURCES:
            return  # no source to name it by, or another by now than what was imported
        payload = dumps(data._reduce())
        for folder in _folders():
            with contextlib.suppress(OSError):
                folder.mkdir(parents=True, exist_ok=True)
                path = self._path(folder, sig, data.codegen)
                # Written aside and renamed: another process never reads half a file.
                handle, temporary = tempfile.mkstemp(dir=folder, prefix=path.name, suffix=".tmp")
                try:
                    with os.fdopen(handle, "wb") as file:
                        os.fchmod(handle, 0o644)  # for whoever else may read the folder
                        file.write(hashlib.sha256(payload).digest() + payload)
                    Path(temporary).replace(path)
                except BaseException:
                    Path(temporary).unlink()
                    raise
                return


def _folders() -> list[Path]:
    """Where kernels may be kept, best first: NUMBA_CACHE_DIR alone if it is set, else beside the code, else at home."""
    if config.CACHE_DIR:
        return [Path(config.CACHE_DIR) / "collide"]
    folders = [Path(__file__).parent / "__pycache__"]
    with contextlib.suppress(RuntimeError):  # no home at all
        folders.append(Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "collide")
    return folders


def _sources_digest() -> str:
    """Of all source files of the package; empty where there are none."""
    sources = sorted(Path(__file__).parent.glob("*.py"))
    digest = hashlib.sha256()
    for source in sources:
        digest.update(source.name.encode() + b"\0" + source.read_bytes())
    return digest.hexdigest() if sources else ""


_SOURCES = _sources_digest()  # at import, as what is compiled later is what was imported now


def _environment() -> tuple[Any, ...]:
    return (
        sys.implementation.cache_tag,
        numba.__version__,
        importlib.metadata.version("llvmlite"),
        config.OPT,
        config.LOOP_VECTORIZE,
        config.SLP_VECTORIZE,
        config.DEBUGINFO_DEFAULT,
    )

"""Compiled kernels on disk: what they are named by, whose are run, and how they are written.

Nothing here may fail a call: whatever is wrong with a file or a folder, its kernel is compiled anew.
"""

from __future__ import annotations

import contextlib
import hashlib
import importlib.machinery
import os
import pickle
import re
import sys
import time
from pathlib import Path
from typing import Any

import llvmlite
import numba
from numba.core import config
from numba.core.caching import NullCache
from numba.core.compiler import CompileResult
from numba.core.serialize import dumps

from .._system import ownership

_PACKAGE = Path(__file__).parents[1]
_DAY = 24 * 3600.0
_UNUSED = 30 * _DAY  # after which a kernel, of an older version perhaps, is removed
_OURS = re.compile(r".*-[0-9a-f]{32}\.nbc(\.[0-9a-f]+\.tmp)?", re.DOTALL)

# What Numba takes from the environment and puts into the code; the processor is named elsewhere.
_SETTINGS = (
    "OPT",
    "LOOP_VECTORIZE",
    "SLP_VECTORIZE",
    "BOUNDSCHECK",  # overrules a function's own option
    "DEBUGINFO_DEFAULT",
    "EXTEND_VARIABLE_LIFETIMES",
    "LLVM_REFPRUNE_PASS",
    "LLVM_REFPRUNE_FLAGS",
    "USING_SVML",
)


class DiskCache(NullCache):  # type: ignore[misc]
    """Compiled kernels on disk, a file each, named by a digest of everything that could change the machine code.

    Numba's own cache looks at one source file only and so serves stale code after an edit of a helper elsewhere. Here
    the name covers every source file of the package, the versions below it, the processor and the options: what is
    stale is never looked up. A damaged file fails its checksum and is compiled anew; nothing writable, nothing kept.

    A kernel is a pickle, so reading it runs it. One is read only if nobody but this user and root can have written it,
    in whatever folder it lies.
    """

    def __init__(self, name: str) -> None:
        self._name = name
        self.path: Path | None = None  # where the kernel is kept, as far as this process knows
        self.was_kept = False  # whether it has been found there

    def _path(self, folder: Path, owner: int, signature: Any, codegen: Any) -> Path:
        # The owner too, as users of one folder would replace each other's kernels, which the others do not read.
        key = (owner, signature, codegen.magic_tuple(), _environment(), _SOURCES)
        return folder / f"{self._name}-{hashlib.sha256(repr(key).encode()).hexdigest()[:32]}.nbc"

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        with contextlib.suppress(Exception):
            target_context.refresh()
            for folder in folders() if _SOURCES else []:
                for owner in ownership.owners():
                    with contextlib.suppress(Exception):
                        path = self._path(folder, owner, sig, target_context.codegen())
                        found = CompileResult._rebuild(target_context, *pickle.loads(_read(path, owner)))
                        self.path, self.was_kept = path, True
                        return found
        return None

    def save_overload(self, sig: Any, data: Any) -> None:
        with contextlib.suppress(Exception):
            if not _SOURCES or _sources_digest() != _SOURCES:
                return  # no source to name it by, or another by now than what was imported
            payload, owner = dumps(data._reduce()), ownership.owners()[0]
            for folder in folders():
                with contextlib.suppress(Exception):
                    folder.mkdir(parents=True, exist_ok=True)
                    path = self._path(folder, owner, sig, data.codegen)
                    _write(path, owner, payload)
                    self.path = path
                    _remove_unused(folder)
                    return


def _checksum(path: Path, payload: bytes) -> bytes:
    """Of the name too: one of the user's kernels under the name of another is damage as well."""
    return hashlib.sha256(path.name.encode() + b"\0" + payload).digest()


def _read(path: Path, owner: int) -> bytes:
    """What _write has written there, or an error."""
    with ownership.open_carefully(path) as file:
        if not ownership.is_safe(file.fileno(), owner):
            raise PermissionError
        last_used, content = os.fstat(file.fileno()).st_mtime, file.read()
    payload = content[32:]
    if _checksum(path, payload) != content[:32]:
        raise ValueError
    if time.time() - last_used > _DAY:
        with contextlib.suppress(OSError):
            os.utime(path)  # in use: see _remove_unused
    return payload


def _write(path: Path, owner: int, payload: bytes) -> None:
    """Written aside and renamed: another process never reads half a file."""
    temporary = path.with_name(f"{path.name}.{os.urandom(8).hex()}.tmp")
    with ownership.new_file(temporary) as file:
        try:
            ownership.show_to_others(file.fileno())
            if not ownership.is_safe(file.fileno(), owner):
                raise PermissionError  # a file system without rights: what is written there would never be read
            file.write(_checksum(path, payload) + payload)
            file.close()
            temporary.replace(path)
        except BaseException:
            file.close()
            temporary.unlink()
            raise


def _remove_unused(folder: Path) -> None:
    """Those that nobody has loaded for a month, and what an interrupted _write has left."""
    for path in folder.glob("*.nbc*"):
        with contextlib.suppress(OSError):
            if _OURS.fullmatch(path.name) and time.time() - path.lstat().st_mtime > _UNUSED:
                path.unlink()


def folders() -> list[Path]:
    """Where kernels may be kept, best first: NUMBA_CACHE_DIR alone if it is set, else beside the code, else at home."""
    if config.CACHE_DIR:
        return [Path(config.CACHE_DIR) / "collide"]
    folders = [_PACKAGE / "__pycache__"]
    with contextlib.suppress(RuntimeError):  # no home at all
        folders.append(ownership.users_caches() / "collide")
    return [folder for folder in folders if folder.is_absolute()]


def _sources_digest() -> str:
    """Of all source files of the package; empty where there are none, or none that can be read."""
    digest = hashlib.sha256()
    try:
        sources = sorted(_PACKAGE.rglob("*.py"))
        for source in sources:
            content = source.read_bytes()
            digest.update(f"{source.relative_to(_PACKAGE).as_posix()}\0{len(content)}\0".encode() + content)
    except Exception:
        return ""
    return digest.hexdigest() if sources else ""


_SOURCES = _sources_digest()  # at import, as what is compiled later is what was imported now


def _environment() -> tuple[Any, ...]:
    return (
        sys.implementation.cache_tag,
        # Tell a free-threaded or a debugging Python from the plain one, as sys.abiflags does, and on Windows too.
        *importlib.machinery.EXTENSION_SUFFIXES,
        sys.flags.optimize,
        numba.__version__,
        llvmlite.__version__,
        *(getattr(config, name, None) for name in _SETTINGS),
    )

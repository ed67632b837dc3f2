"""Names of files and folders, changed in one step where the system can, and files that are on the disk by then."""

from __future__ import annotations

import contextlib
import ctypes
import errno
import os
from pathlib import Path

# Of Linux's renameat2.
_HERE, _KEEP, _EXCHANGE = -100, 1, 2  # AT_FDCWD, RENAME_NOREPLACE, RENAME_EXCHANGE


def sync(path: Path) -> None:
    """To the disk: a name must not be there before its content, whatever happens to the machine."""
    handle = os.open(path, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def rename_if_free(temporary: Path, path: Path, is_folder: bool) -> None:
    """Renamed, unless something has that name: in one step, or else with a moment in which it is there and empty.

    That moment is better than a look before an ordinary rename, which would replace what comes in between.
    """
    try:
        if _renameat2(temporary, path, _KEEP):
            return
        path.mkdir() if is_folder else path.touch(exist_ok=False)
    except FileExistsError:
        raise OSError("has appeared while this ran, and stays as it is (--overwrite replaces it)") from None
    try:
        temporary.replace(path)
    except BaseException:
        if temporary.exists():  # the name was taken for nothing
            with contextlib.suppress(OSError):
                path.rmdir() if is_folder else path.unlink()
        raise


def exchange(one: Path, other: Path) -> None:
    """Two folders change their names: at once where the system can, else with a moment in which `other` is away."""
    if _renameat2(one, other, _EXCHANGE):
        return
    aside = one.with_suffix(".old")
    other.rename(aside)
    try:
        one.rename(other)
    except BaseException:
        aside.rename(other)
        raise
    aside.rename(one)


def _renameat2(one: Path, other: Path, how: int) -> bool:
    """Whether the system has done it: some cannot, nor can all file systems."""
    try:
        renameat2 = ctypes.CDLL(None, use_errno=True).renameat2
    except (AttributeError, OSError):  # no such function in the C library
        return False
    if renameat2(_HERE, os.fsencode(one), _HERE, os.fsencode(other), how) == 0:
        return True
    if ctypes.get_errno() == errno.EEXIST:
        raise FileExistsError(errno.EEXIST, os.strerror(errno.EEXIST), str(other))
    return False

"""Names of files and folders: which there may be, and how they change in one step, where the system can."""

from __future__ import annotations

import contextlib
import ctypes
import errno
import os
import re
import sys
from pathlib import Path

# Windows would write to the device, or to a stream of the file before the colon, and say nothing.
_DEVICES_AND_PARTS = r"""(?i)[<>:"/\\|?*]|^(con|prn|aux|nul|com\d|lpt\d)(\.|$)"""
_TAKEN = re.compile(_DEVICES_AND_PARTS if sys.platform == "win32" else "\0")


def can_be_called(name: str) -> bool:
    """Whether a file may have this name: what names another folder, a device or a part of a file may not."""
    return Path(name).name == name and not _TAKEN.search(name)


def rename_if_free(temporary: Path, path: Path, is_folder: bool) -> None:
    """Renamed, unless something has that name: in one step, or else with a moment in which it is there and empty.

    That moment is better than a look before an ordinary rename, which would replace what comes in between.
    """
    try:
        if _renamed(temporary, path, _KEEP):
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
    if _renamed(one, other, _EXCHANGE):
        return
    aside = one.with_suffix(".old")
    other.rename(aside)
    try:
        one.rename(other)
    except BaseException:
        aside.rename(other)
        raise
    aside.rename(one)


if sys.platform == "win32":
    _KEEP, _EXCHANGE = "keep", "exchange"

    def _renamed(one: Path, other: Path, how: str) -> bool:
        """Whether the system has done it: it cannot exchange, and renames only to what is free."""
        if how == _KEEP:
            one.rename(other)
        return how == _KEEP

else:

    def _renamed(one: Path, other: Path, how: int) -> bool:
        """Whether the system has done it: some cannot, nor can all file systems."""
        try:
            failed = _call(ctypes.CDLL(None, use_errno=True), os.fsencode(one), os.fsencode(other), how)
        except (AttributeError, OSError):  # no such function in the C library
            return False
        if failed and ctypes.get_errno() == errno.EEXIST:
            raise FileExistsError(errno.EEXIST, os.strerror(errno.EEXIST), str(other))
        return not failed


if sys.platform == "darwin":
    _KEEP, _EXCHANGE = 4, 2  # RENAME_EXCL, RENAME_SWAP

    def _call(library: ctypes.CDLL, one: bytes, other: bytes, how: int) -> int:
        return int(library.renamex_np(one, other, how))

elif sys.platform != "win32":
    _KEEP, _EXCHANGE = 1, 2  # RENAME_NOREPLACE, RENAME_EXCHANGE
    _HERE = -100  # AT_FDCWD

    def _call(library: ctypes.CDLL, one: bytes, other: bytes, how: int) -> int:
        return int(library.renameat2(_HERE, one, _HERE, other, how))

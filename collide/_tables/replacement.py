"""A file or folder that has its name when all is written, and not before: whole or not at all."""

from __future__ import annotations

import contextlib
import ctypes
import errno
import os
import tempfile
from collections.abc import Iterator
from pathlib import Path

# Of Linux's renameat2.
_HERE, _KEEP, _EXCHANGE = -100, 1, 2  # AT_FDCWD, RENAME_NOREPLACE, RENAME_EXCHANGE


@contextlib.contextmanager
def output(path: Path, is_folder: bool, overwrite: bool) -> Iterator[Path]:
    """A new file or folder, of .npy files, that becomes `path` when all is written, and vanishes on any error.

    Unless it is to be overwritten, nothing that is at `path` by then is replaced. A folder is only if it is one of .npy
    files by then: else it stays.
    """
    prefix = f".{path.name[:40]}."
    if is_folder:
        temporary = Path(tempfile.mkdtemp(".tmp", prefix, path.parent))
    else:
        handle, name = tempfile.mkstemp(".tmp", prefix, path.parent)
        os.close(handle)
        temporary = Path(name)
    try:
        yield temporary
        for written in (temporary, *temporary.iterdir()) if is_folder else (temporary,):
            _sync(written)
        mask = os.umask(0)
        os.umask(mask)
        temporary.chmod(path.stat().st_mode & 0o777 if path.exists() else (0o777 if is_folder else 0o666) & ~mask)
        if not overwrite:
            _name(temporary, path, is_folder)
        elif is_folder and path.exists():
            _replace_folder(temporary, path)
        else:
            temporary.replace(path)
    finally:  # gone if it has been renamed; after an exchange it is the old folder
        if is_folder:
            _remove(temporary)
        else:
            temporary.unlink(missing_ok=True)


def columns_only(path: Path) -> bool:
    """Whether a path is a folder of .npy files, and of nothing else that might get lost with it."""
    return path.is_dir() and all(map(_is_column, path.iterdir()))


def _is_column(file: Path) -> bool:
    return file.suffix == ".npy" and file.is_file()


def _remove(folder: Path) -> None:
    """What is no column is never removed, nor the folder with it."""
    with contextlib.suppress(OSError):
        for file in filter(_is_column, folder.iterdir()):
            file.unlink()
        folder.rmdir()


def _sync(path: Path) -> None:
    """To the disk: a name must not be there before its content, whatever happens to the machine."""
    handle = os.open(path, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def _name(temporary: Path, path: Path, is_folder: bool) -> None:
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


def _replace_folder(temporary: Path, path: Path) -> None:
    """What is in the old one is seen once nobody else knows its name, and can fill it: it may have to return."""
    _exchange(temporary, path)
    if not columns_only(temporary):
        _exchange(temporary, path)
        raise OSError("is by now not a folder of .npy files only, and stays as it is")


def _exchange(one: Path, other: Path) -> None:
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

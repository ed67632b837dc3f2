"""A file or folder that has its name when all is written, and not before: whole or not at all."""

from __future__ import annotations

import contextlib
import os
import threading
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from .._system import disk, ownership, renaming

_PAUSE = 0.05  # seconds between two looks at what is to be written to the disk


@contextlib.contextmanager
def output(path: Path, is_folder: bool, overwrite: bool) -> Iterator[Path]:
    """A new file or folder, of .npy files, that becomes `path` when all is written, and vanishes on any error.

    Unless it is to be overwritten, nothing that is at `path` by then is replaced. A folder is replaced only if it holds
    nothing but .npy files then; else it stays, and that is an error.
    """
    temporary = path.with_name(f".{path.name[:40]}.{os.urandom(8).hex()}.tmp")
    if is_folder:
        ownership.new_folder(temporary)
    else:
        ownership.new_file(temporary).close()
    try:
        with _synced(temporary):
            yield temporary
        ownership.give_rights(temporary, path)
        if not overwrite:
            renaming.rename_if_free(temporary, path, is_folder)
        elif is_folder and path.exists():
            _replace_folder(temporary, path)
        else:
            temporary.replace(path)
    finally:  # gone if it has been renamed; after an exchange it is the old folder
        if is_folder:
            _remove(temporary)
        else:
            temporary.unlink(missing_ok=True)


@contextlib.contextmanager
def _synced(path: Path) -> Iterator[None]:
    """On the disk at the end, for the most part before: it is written there while more comes."""
    ended = threading.Event()

    def sync(last: bool) -> None:
        for written in (path, *path.iterdir()) if path.is_dir() else (path,):
            disk.sync(written, last)

    def sync_now_and_then() -> None:
        while not ended.wait(_PAUSE):
            sync(last=False)

    with ThreadPoolExecutor(1) as pool:
        try:
            syncing = pool.submit(sync_now_and_then)
            yield
        finally:
            ended.set()
        syncing.result()  # an error of the disk, which it tells only once
        sync(last=True)


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


def _replace_folder(temporary: Path, path: Path) -> None:
    """What the old one holds is looked at after the exchange, when nobody else can add to it; it may have to return."""
    renaming.exchange(temporary, path)
    if not columns_only(temporary):
        renaming.exchange(temporary, path)
        raise OSError("is by now not a folder of .npy files only, and stays as it is")

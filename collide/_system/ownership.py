"""Whose a file is, who else may read or write it, and where the user's caches are."""

from __future__ import annotations

import os
import stat
import sys
from pathlib import Path
from typing import BinaryIO

if sys.platform == "win32":
    # Files have no owners and rights of this kind: they inherit rights from their folder, and what lies in the user's
    # folders is the user's.

    def open_carefully(path: Path) -> BinaryIO:
        """A file to read."""
        return path.open("rb")

    def owners() -> tuple[int, ...]:
        """One that stands for all whose files are trusted."""
        return (0,)

    def new_folder(path: Path) -> None:
        """A folder."""
        path.mkdir()  # with no mode: 0o700 would shut out others for good

    def show_to_others(handle: int) -> None:
        """Whoever may read the folder may read the file already."""

    def give_rights(new: Path, old: Path) -> None:
        """Those of its folder, which it has already."""

    def is_safe(handle: int, owner: int) -> bool:
        """Whether it is a file. Asked of what has been opened: the name may be another's file by now."""
        return stat.S_ISREG(os.fstat(handle).st_mode)

else:

    def open_carefully(path: Path) -> BinaryIO:
        """A file to read, itself and at once.

        Not to wait for the writer of a FIFO in a file's place, and not to follow a link to another file of the user's.
        """
        careful = os.O_NONBLOCK | os.O_NOFOLLOW
        return open(path, "rb", opener=lambda name, flags: os.open(name, flags | careful))

    def owners() -> tuple[int, ...]:
        """Whose files are trusted: those of this user, who comes first, and of root."""
        return os.geteuid(), 0

    def new_folder(path: Path) -> None:
        """A folder, open to nobody else until its rights are known."""
        path.mkdir(0o700)

    def show_to_others(handle: int) -> None:
        """Whoever may read the folder may read the file, and nobody but its owner write it."""
        os.fchmod(handle, 0o644)

    def give_rights(new: Path, old: Path) -> None:
        """Those of what it is to replace, or else those that anything new gets."""
        mask = os.umask(0)
        os.umask(mask)
        usual = (0o777 if new.is_dir() else 0o666) & ~mask
        new.chmod(old.stat().st_mode & 0o777 if old.exists() else usual)

    def is_safe(handle: int, owner: int) -> bool:
        """Whether it is a file that the owner has written, and that nobody else may write.

        Asked of what has been opened: the name may be another's file by now.
        """
        status = os.fstat(handle)
        others = stat.S_IWGRP | stat.S_IWOTH
        return stat.S_ISREG(status.st_mode) and status.st_uid == owner and not status.st_mode & others


def new_file(path: Path) -> BinaryIO:
    """A file to write, open to nobody else until its rights are known, whatever the umask."""
    return open(path, "xb", opener=lambda name, flags: os.open(name, flags, 0o600))


_CACHES = {"win32": "AppData/Local", "darwin": "Library/Caches"}.get(sys.platform, ".cache")


def users_caches() -> Path:
    """The folder for the caches of the user's programs; RuntimeError where there is no home at all."""
    folder = Path(os.environ.get("XDG_CACHE_HOME", ""))
    # One that is not absolute is to be ignored, says the XDG Base Directory Specification.
    return folder if folder.is_absolute() else Path.home() / _CACHES

"""Whose a file is, who else may have written it, and where the user's caches are."""

from __future__ import annotations

import os
import stat
from pathlib import Path
from typing import BinaryIO

# Where files have no owners and rights of this kind, on Windows, what lies in the user's folders is the user's.
_OWNED = hasattr(os, "geteuid")
# Not to wait for the writer of a FIFO in a file's place, and not to follow a link to another file of the user's.
_CAREFUL = getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_NOFOLLOW", 0)


def open_carefully(path: Path) -> BinaryIO:
    """A file to read, itself and at once."""
    return open(path, "rb", opener=lambda name, flags: os.open(name, flags | _CAREFUL))


def owners() -> tuple[int, ...]:
    """Whose files are trusted: those of this user, who comes first, and of root."""
    return (os.geteuid(), 0) if _OWNED else (0,)


def show_to_others(handle: int) -> None:
    """Whoever may read the folder may read the file, and nobody but its owner write it."""
    if _OWNED:
        os.fchmod(handle, 0o644)


def is_safe(handle: int, owner: int) -> bool:
    """Whether it is a file that the owner has written, and that nobody else may write.

    Asked of what has been opened: the name may be another's file by now.
    """
    status = os.fstat(handle)
    if not _OWNED:
        return stat.S_ISREG(status.st_mode)
    others = stat.S_IWGRP | stat.S_IWOTH
    return stat.S_ISREG(status.st_mode) and status.st_uid == owner and not status.st_mode & others


def users_caches() -> Path:
    """The folder for the caches of the user's programs; RuntimeError where there is no home at all."""
    folder = Path(os.environ.get("XDG_CACHE_HOME", ""))
    # One that is not absolute is to be ignored, says the XDG Base Directory Specification.
    return folder if folder.is_absolute() else Path.home() / ".cache"

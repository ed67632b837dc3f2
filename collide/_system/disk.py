"""Files that are on the disk: a name must not be there before its content, whatever happens to the machine."""

from __future__ import annotations

import errno
import os
import sys
from pathlib import Path

if sys.platform == "win32":

    def sync(path: Path, last: bool) -> None:
        """A file, to the disk; of folders the system takes care."""
        if not path.is_dir():
            with path.open("r+b") as file:  # what is open for reading cannot be
                os.fsync(file.fileno())

else:

    def sync(path: Path, last: bool) -> None:
        """A file or a folder, to the disk; unless it is the last time, for the most part will do."""
        handle = os.open(path, os.O_RDONLY)
        try:
            (_sync_drive if last else os.fsync)(handle)
        finally:
            os.close(handle)


if sys.platform == "darwin":
    import fcntl

    def _sync_drive(handle: int) -> None:
        """Its fsync ends before the memory that a drive has itself."""
        try:
            fcntl.fcntl(handle, fcntl.F_FULLFSYNC)
        except OSError as error:
            if error.errno not in (errno.ENOTSUP, errno.EINVAL, errno.ENOTTY):  # network drives cannot
                raise
            os.fsync(handle)

else:

    def _sync_drive(handle: int) -> None:
        os.fsync(handle)

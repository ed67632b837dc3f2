"""Tables on disk, each a file or a folder of them: what a round puts back before it, and waits for at its end."""

from __future__ import annotations

import os
import shutil
import sys
from pathlib import Path

import pytest


def _parts(path: Path) -> list[Path]:
    return sorted(path.iterdir()) if path.is_dir() else [path]


def sync(path: Path) -> None:
    for part in _parts(path):
        handle = os.open(part, os.O_RDONLY)
        os.fsync(handle)
        os.close(handle)


def forget(path: Path) -> None:
    """Asks the system to keep nothing of it in memory."""
    if sys.platform != "linux":
        pytest.skip("no other system than Linux can be asked to")
    sync(path)
    for part in _parts(path):
        handle = os.open(part, os.O_RDONLY)
        os.posix_fadvise(handle, 0, 0, os.POSIX_FADV_DONTNEED)
        os.close(handle)


def remove(path: Path) -> None:
    if path.is_dir():
        shutil.rmtree(path)
    else:
        path.unlink(missing_ok=True)

"""How much memory there is, and the piece that one search for contacts leaves to the next."""

from __future__ import annotations

import contextlib
import functools
import os
from pathlib import Path
from typing import Any

import numpy as np

from .._typing import Array

CACHE_LINE = 64  # bytes: what a streaming store has to fill


@functools.cache
def installed() -> int:
    """The bytes that the machine has, or the control group grants; a very large number where neither says."""
    limits = [1 << 48]
    if hasattr(os, "sysconf"):
        limits.append(os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE"))
    with contextlib.suppress(OSError, ValueError):  # "max" is no number
        limits.append(int(Path("/sys/fs/cgroup/memory.max").read_text()))
    return min(limits)


def free() -> int:
    """The bytes that the system would give now, of those installed; all of them where it does not say."""
    with contextlib.suppress(OSError, ValueError, IndexError):
        return min(installed(), 1024 * int(Path("/proc/meminfo").read_text().split("MemAvailable:")[1].split()[0]))
    return installed()


_LARGEST_SPARE = 1 << 24  # bytes
_spare: list[Array] = []  # one piece at most; taken and left without a lock, as a list's own steps are whole


class Scratch:
    """One piece of memory for many arrays, each on a cache line, which serves the next who needs some as well.

    Fresh memory costs more than the sort of a search: 10,000 balls took 85 ns each and not 53. Large pieces are given
    back.
    """

    def __init__(self, size: int) -> None:
        self._memory = np.empty(0, np.uint8)
        with contextlib.suppress(IndexError):
            self._memory = _spare.pop()
        if self._memory.size < size:
            self._memory = np.empty(size, np.uint8)
        self._at = -self._memory.ctypes.data % CACHE_LINE

    def take(self, n: int, dtype: Any) -> Array:
        size = n * np.dtype(dtype).itemsize
        array: Array = self._memory[self._at : self._at + size].view(dtype)
        self._at += -(-size // CACHE_LINE) * CACHE_LINE
        return array

    def leave(self) -> None:
        if self._memory.size <= _LARGEST_SPARE:
            _spare[:] = [self._memory]

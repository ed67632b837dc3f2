"""How much memory there is."""

from __future__ import annotations

import contextlib
import functools
import os
from pathlib import Path

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

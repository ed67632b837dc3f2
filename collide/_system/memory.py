"""How much memory there is."""

from __future__ import annotations

import contextlib
import functools
import os
from pathlib import Path

CACHE_LINE = 64  # bytes: what a streaming store has to fill


_GROUP = Path("/sys/fs/cgroup")


@functools.cache
def installed() -> int:
    """The bytes that the machine has, or the control group or a limit of the process grants; very many if none says."""
    limits = [1 << 48]
    if hasattr(os, "sysconf"):
        limits.append(os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE"))
    with contextlib.suppress(OSError, ValueError):  # "max" is no number
        limits.append(int((_GROUP / "memory.max").read_text()))
    with contextlib.suppress(ImportError):
        import resource  # not there on Windows

        limits += [n for n in [resource.getrlimit(resource.RLIMIT_AS)[0]] if n != resource.RLIM_INFINITY]
    return min(limits)


def free() -> int:
    """The bytes that the system would give now, of those installed; all of them where it does not say."""
    left = [installed()]
    with contextlib.suppress(OSError, ValueError, IndexError):
        left.append(1024 * int(Path("/proc/meminfo").read_text().split("MemAvailable:")[1].split()[0]))
    with contextlib.suppress(OSError, ValueError):
        left.append(int((_GROUP / "memory.max").read_text()) - int((_GROUP / "memory.current").read_text()))
    return min(left)

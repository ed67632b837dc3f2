"""How much memory there is."""

from __future__ import annotations

import contextlib
import ctypes
import functools
import os
import sys
from pathlib import Path

CACHE_LINE = 64  # bytes: what a streaming store has to fill

_GROUP = Path("/sys/fs/cgroup")
_UNKNOWN = 1 << 48  # bytes: very many


@functools.cache
def installed() -> int:
    """The bytes that the machine has, or the control group or a limit of the process grants; very many if none says."""
    limits = [_of_machine()[0], *_of_process()]
    with contextlib.suppress(OSError, ValueError):  # "max" is no number
        limits.append(int((_GROUP / "memory.max").read_text()))
    return min(limits)


def free() -> int:
    """The bytes that the system would give now, of those installed; all of them where it does not say."""
    left = [installed(), _of_machine()[1]]
    with contextlib.suppress(OSError, ValueError):
        left.append(int((_GROUP / "memory.max").read_text()) - int((_GROUP / "memory.current").read_text()))
    return min(left)


# Of the machine: the bytes that it has, and those that are free or would be made free.
if sys.platform == "win32":

    class _Status(ctypes.Structure):
        """MEMORYSTATUSEX, as GlobalMemoryStatusEx fills it."""

        _fields_ = (
            ("length", ctypes.c_uint32),
            ("load", ctypes.c_uint32),
            ("total", ctypes.c_uint64),
            ("free", ctypes.c_uint64),
            ("others", ctypes.c_uint64 * 5),
        )

    def _of_machine() -> tuple[int, int]:
        status = _Status(length=ctypes.sizeof(_Status))
        if not ctypes.windll.kernel32.GlobalMemoryStatusEx(ctypes.byref(status)):
            return _UNKNOWN, _UNKNOWN
        return status.total, status.free

elif sys.platform == "darwin":

    def _of_machine() -> tuple[int, int]:
        total = _said(b"hw.memsize", ctypes.c_uint64(_UNKNOWN))
        return total, total // 100 * _said(b"kern.memorystatus_level", ctypes.c_int(100))  # of a hundred

    def _said(name: bytes, value: ctypes.c_uint64 | ctypes.c_int) -> int:
        """What sysctl says; the value as it is where it says nothing."""
        size = ctypes.c_size_t(ctypes.sizeof(value))
        ctypes.CDLL(None).sysctlbyname(name, ctypes.byref(value), ctypes.byref(size), None, ctypes.c_size_t(0))
        return value.value

else:

    def _of_machine() -> tuple[int, int]:
        total = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
        with contextlib.suppress(OSError, ValueError, IndexError):
            return total, 1024 * int(Path("/proc/meminfo").read_text().split("MemAvailable:")[1].split()[0])
        return total, total


# Of the process: what limits it.
if sys.platform == "win32":

    def _of_process() -> list[int]:
        return []

else:
    import resource

    def _of_process() -> list[int]:
        return [n for n in resource.getrlimit(resource.RLIMIT_AS)[:1] if n != resource.RLIM_INFINITY]

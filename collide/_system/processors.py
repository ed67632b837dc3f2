"""How many processors there are."""

from __future__ import annotations

import contextlib
import math
import os
import sys
from pathlib import Path


def available() -> int:
    """Those that the process may use: its affinity mask and its control group's quota count where there are such."""
    return max(1, min(_usable() or 1, _quota()))


def _usable() -> int | None:
    if sys.version_info >= (3, 13):
        return os.process_cpu_count()
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()


def _quota() -> int:
    """The processors that the control group grants, rounded up; a very large number where it sets no limit."""
    with contextlib.suppress(OSError, ValueError):  # version 2; "max" is no number
        quota, period = Path("/sys/fs/cgroup/cpu.max").read_text().split()
        return math.ceil(int(quota) / int(period))
    with contextlib.suppress(OSError, ValueError):  # version 1; -1 is no limit
        folder = Path("/sys/fs/cgroup/cpu")
        quota_us = int((folder / "cpu.cfs_quota_us").read_text())
        if quota_us > 0:
            return math.ceil(quota_us / int((folder / "cpu.cfs_period_us").read_text()))
    return 1 << 30

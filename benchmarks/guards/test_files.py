"""`collide resolve` beside what else one would use, and how much memory it takes."""

from __future__ import annotations

import re
import statistics
import subprocess
import sys

import disk
import duels
import pytest
from cases import FILE_PAIRS

from . import hold

PEAK = """
import re, sys
from importlib.metadata import entry_points
(collide,) = entry_points(group="console_scripts", name="collide")
assert collide.load()(sys.argv[1:]) == 0
print(re.search(r"VmHWM:\\s+(\\d+) kB", open("/proc/self/status").read())[1])
"""


LEAST = {"Polars": 0.9, "DuckDB": 1.5, "a plain copy": 0.8}


@pytest.mark.parametrize("rival", LEAST)
@pytest.mark.parametrize("cold", [False, True], ids=["warm", "cold"])
def test_rate(source, cold, rival):
    kind = "Parquet" if source.suffix else "a folder"
    what = f"{FILE_PAIRS:,} pairs, {kind}, {'cold' if cold else 'warm'}, as fast as {rival}"
    hold(what, *duels.table(rival, source, cold), 3, statistics.median, least=LEAST[rival])


def test_memory(source):
    target = source.with_name(f"after{source.suffix}")
    disk.remove(target)
    command = [sys.executable, "-c", PEAK, "resolve", str(source), "-o", str(target), "--quiet"]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    peak = int(re.search(r"\d+", done.stdout)[0]) / 1024
    print(f"\n{FILE_PAIRS:,} pairs, {'Parquet' if source.suffix else 'a folder'}: {peak:.0f} MiB at most", end=" ")
    assert peak < 1024

"""What a run saved, as pytest-benchmark's JSON: the entries of batches, every duel, and the names of all their cases.

Every contestant was timed in rounds interleaved with collide's. What counts as its rate is that ratio times the rate of
collide in a measurement of its own, so that a slow minute of the machine moves all figures of a column alike.
"""

from __future__ import annotations

from typing import Any, NamedTuple

FORMS = {
    "1d": "on a line",
    "2d": "in the plane",
    "3d": "in space",
    "polar": "polar form",
    "impact": "time of impact",
    "impact_3d": "time of impact in space",
}
COLLISIONS = ("1d", "2d", "3d", "polar")
# Name in the data: name in the table, name in the pictures, colour, marker.
CONTESTANTS = {
    "bytes only": ("the memory limit: the same bytes, nothing computed", "the memory limit", "#8b949e", ""),
    "collide": ("collide", "collide", "#e5534b", "o"),
    "prange": ("Numba prange (polar: libm)", "Numba prange", "#4493f8", "s"),
    "prange, same formula": ("Numba prange, collide's own formula", "prange, collide's formula", "#1f9e89", "D"),
    "C": ("C: cc -O3 -march=native -fopenmp", "C with OpenMP", "#b083f0", "^"),
    "Taichi": ("Taichi", "Taichi", "#d4a72c", "v"),
    "numexpr": ("numexpr", "numexpr", "#57ab5a", "P"),
    "JAX": ("JAX", "JAX", "#e275ad", "X"),
    "NumPy": ("NumPy", "NumPy", "#f0883e", "*"),
    "pymunk": ("pymunk, one step of an engine", "pymunk, one step", "#a5734f", "h"),
}
LARGE = 10_000_000


class Entry(NamedTuple):
    """One contestant in one case: its pairs a second, and how many times as fast as it collide is."""

    rate: float
    ratio: float


Key = tuple[str, int, int, str]  # form, pairs, threads, contestant


def entries(data: dict[str, Any]) -> dict[Key, Entry]:
    batches = [b for b in data["benchmarks"] if "contestant" in b["extra_info"]]
    own: dict[Any, float] = {}
    for b in batches:
        info = b["extra_info"]
        if info["contestant"] == "collide":
            own[info["form"], info["n"], info["threads"]] = info["n"] / b["stats"]["median"]
    found = {}
    for b in batches:
        info = b["extra_info"]
        case = info["form"], info["n"], info["threads"]
        ratio = 1.0 if info["contestant"] == "collide" else 1 / info["as fast as the reference"]
        found[(*case, info["contestant"])] = Entry(own[case] / ratio, ratio)
    return found


class Duel(NamedTuple):
    """How many times as long as collide a rival took in one case."""

    case: str
    rival: str
    ratio: float


def duels(data: dict[str, Any]) -> list[Duel]:
    """Of all that was measured against others; not the memory limit, which computes nothing."""
    found = []
    for b in data["benchmarks"]:
        info = b["extra_info"]
        if "as fast as the reference" not in info:
            continue
        fast = info["as fast as the reference"]
        if info.get("contestant", info.get("by")) in ("collide", "bytes only"):
            continue
        if "contestant" in info:
            alone = ", on 1 thread" * (info["threads"] == 1)
            found.append(Duel(f"{counted(info['n'])}, {FORMS[info['form']]}{alone}", info["contestant"], 1 / fast))
        elif "by" in info:
            found.append(Duel(f"{counted(info['n'])}, {info['way']}", info["by"], 1 / fast))
        elif "file" in info:  # here the rival is the reference
            found.append(Duel(info["file"], info["rival"], fast))
        elif "rival" in info:
            found.append(Duel(b["group"], info["rival"], 1 / fast))
        elif "drawn" in info:
            found.append(Duel(f"500,000 pairs of a million balls in {info['drawn']}", "NumPy", 1 / fast))
    return found


def counted(n: int, what: str = "pair") -> str:
    return f"{n:,} {what}{'s' * (n > 1)}"


def number(x: float) -> str:
    """Three figures at most, and no exponent."""
    return f"{x:.0f}" if x >= 100 else f"{x:.1f}" if x >= 10 else f"{x:.2f}"

"""`collide demo`: random pairs, timed against NumPy and against the memory limit in the same run."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable
from typing import Any

import numpy as np

from .. import batch, get_num_threads
from .._pairs import execution
from .._pairs.forms import COLLISIONS, Form
from .._tables.by_name import counted
from .._tables.conservation import Conservation
from .against_numpy import EXPRESSIONS, random_pairs
from .kernels import place
from .limit import LIMITS
from .status_line import status_line

# All in half a minute: where nothing is kept, each form takes six or seven seconds to compile, with its yardsticks.
NAMES = {"2d": "in the plane", "3d": "in space", "polar": "in polar form"}
# Beyond the caches, and of arrays so large that NumPy's own results are fresh memory at each call.
_PAIRS, _ROUNDS, _NUMPYS_ROUNDS = 5_000_000, 7, 2
_HEAD = """\
                  million  times as fast     of the     drift of total      first
                  pairs/s       as NumPy      limit   momentum   energy      call"""
_NOTES = """\
NumPy: the expression that one would write, on arrays. The limit: a kernel that moves the same bytes, and only that.
The first call of each function loads its kernel from disk, or compiles it; `collide compile` makes all kernels ahead.
"""


def main(n: int = _PAIRS, rounds: int = _ROUNDS) -> None:
    began = time.perf_counter()
    threads = counted(get_num_threads(), "thread")
    print(f"{n:,} random pairs, float64, {threads}; medians of {rounds} rounds\n\n{_HEAD}", flush=True)
    with status_line() as show:
        for name in NAMES:
            row = _row(COLLISIONS[name], n, rounds, show)
            show("")
            print(f"{NAMES[name]:15}{row}", flush=True)
    where = place(COLLISIONS[name].kernels["dd"])
    print(f"\n{_NOTES}{where[0].upper()}{where[1:]}.\n{time.perf_counter() - began:.1f} s in all")


def _row(form: Form, n: int, rounds: int, show: Callable[[str], None]) -> str:
    """What the table says of a form."""
    show(f"{NAMES[form.name]}: random pairs")
    columns, out = random_pairs(form.name, n), tuple(np.zeros(n) for _ in form.outputs)
    resolve: Any = getattr(batch, f"resolve_{form.name}")
    contestants: dict[str, Callable[[], Any]] = {
        "collide": lambda: resolve(*columns, out=out),
        "limit": lambda: execution.call(LIMITS[form.name], (*columns, 1.0), False, "raise", out),
        "NumPy": lambda: EXPRESSIONS[form.name](*columns),
    }
    show(f"{NAMES[form.name]}: the first call, which compiles if nothing is kept")
    first_call = _seconds(lambda: resolve(*(column[:1] for column in columns)))
    kept = Conservation()
    contestants["collide"]()
    kept.add(form, (*columns, 1.0), out)
    contestants["limit"]()
    contestants["NumPy"]()  # whose first call takes up to four times as long, as all its results are new memory
    show(f"{NAMES[form.name]}: {counted(rounds, 'round')}")
    times: dict[str, list[float]] = {key: [] for key in contestants}
    for i in range(rounds):
        for key, contestant in contestants.items():
            if key != "NumPy" or i < _NUMPYS_ROUNDS:  # it takes a second
                times[key].append(_seconds(contestant))
    median = {key: statistics.median(values) for key, values in times.items()}
    first = f"{first_call:6.2f} s  {'loaded' if form.kernels['dd'].cache.was_kept else 'compiled'}"
    return (
        f"{n / median['collide'] / 1e6:10.1f}{median['NumPy'] / median['collide']:15.1f}"
        f"{median['limit'] / median['collide']:11.2f}{abs(kept.momentum):11.0e}{abs(kept.energy):9.0e}{first}"
    )


def _seconds(call: Callable[[], Any]) -> float:
    began = time.perf_counter()
    call()
    return time.perf_counter() - began

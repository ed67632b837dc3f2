"""`collide demo`: ten million random pairs, timed against NumPy and against the memory limit in the same run."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable
from typing import Any

import numpy as np

from .. import batch, get_num_threads
from .._pairs import execution
from .._pairs.forms import FORM_2D, FORM_POLAR, Form
from .._tables.conservation import Conservation
from .._typing import Array
from .limit import LIMITS


def numpy_2d(m1: Any, m2: Any, v1x: Any, v1y: Any, v2x: Any, v2y: Any, nx: Any, ny: Any) -> Any:
    """What a NumPy user would write."""
    q = 2.0 * ((v1x - v2x) * nx + (v1y - v2y) * ny) / ((m1 + m2) * (nx * nx + ny * ny))
    return v1x - m2 * q * nx, v1y - m2 * q * ny, v2x + m1 * q * nx, v2y + m1 * q * ny


def numpy_polar(m1: Any, m2: Any, v1: Any, theta1: Any, v2: Any, theta2: Any, phi: Any) -> Any:
    """The textbook's formula as it stands."""
    along1, along2 = v1 * np.cos(theta1 - phi), v2 * np.cos(theta2 - phi)
    across1, across2 = v1 * np.sin(theta1 - phi), v2 * np.sin(theta2 - phi)
    after1 = ((m1 - m2) * along1 + 2.0 * m2 * along2) / (m1 + m2)
    after2 = ((m2 - m1) * along2 + 2.0 * m1 * along1) / (m1 + m2)
    c, s, c90, s90 = np.cos(phi), np.sin(phi), np.cos(phi + np.pi / 2), np.sin(phi + np.pi / 2)
    return (
        after1 * c + across1 * c90,
        after1 * s + across1 * s90,
        after2 * c + across2 * c90,
        after2 * s + across2 * s90,
    )


def random_pairs(n: int) -> tuple[list[Array], list[Array]]:
    """n pairs by their components, and the same in polar form."""
    rng = np.random.default_rng(0)
    m1, m2, v1, v2 = (rng.uniform(0.1, 10.0, n) for _ in range(4))
    theta1, theta2, phi = (rng.uniform(-np.pi, np.pi, n) for _ in range(3))
    components = [m1, m2]
    for length, angle in ((v1, theta1), (v2, theta2), (1.0, phi)):
        components += [length * np.cos(angle), length * np.sin(angle)]
    return components, [m1, m2, v1, theta1, v2, theta2, phi]


def main(n: int = 10_000_000, rounds: int = 7) -> None:
    began = time.perf_counter()
    components, polar = random_pairs(n)
    out = tuple(np.zeros(n) for _ in range(4))
    print(f"{n:,} random pairs, float64, {get_num_threads()} threads; medians of interleaved rounds\n")
    _compare(batch.resolve_2d, numpy_2d, FORM_2D, components, out, rounds)
    print(_drift(FORM_2D, components, out))
    _compare(batch.resolve_polar, numpy_polar, FORM_POLAR, polar, out, rounds)
    print(_drift(FORM_POLAR, polar, out))
    print(f"{time.perf_counter() - began:.1f} s in all")


def _compare(
    resolve: Any, in_numpy: Any, form: Form, columns: list[Array], out: tuple[Array, ...], rounds: int
) -> None:
    """Prints how the batch function does against the NumPy expression and the memory limit."""
    n, bytes_only = out[0].size, LIMITS[form.name]
    contestants: dict[str, Callable[[], Any]] = {
        "limit": lambda: execution.call(bytes_only, (*columns, 1.0), False, "raise", out),
        "NumPy": lambda: in_numpy(*columns),
        "collide": lambda: resolve(*columns, out=out),
    }
    compiled_in = _seconds(lambda: resolve(*(column[:1] for column in columns)))
    _seconds(contestants["limit"])
    times: dict[str, list[float]] = {key: [] for key in contestants}
    for i in range(rounds):
        for key, contestant in contestants.items():
            if key != "NumPy" or i < 2:  # it takes seconds
                times[key].append(_seconds(contestant))
    median = {key: statistics.median(values) for key, values in times.items()}
    print(f"{form.name:10} {n / median['collide'] / 1e6:7.1f} million pairs/s")
    print(f"{'':10} {median['NumPy'] / median['collide']:7.1f} times as fast as the NumPy expression")
    print(
        f"{'':10} {median['limit'] / median['collide']:7.2f} of the memory limit (a kernel that moves the same bytes)"
    )
    print(f"{'':10} {compiled_in:7.2f} s for the first call: compiling, or loading what an earlier run compiled")


def _drift(form: Form, columns: list[Array], out: tuple[Array, ...]) -> str:
    kept = Conservation()
    kept.add(form, (*columns, 1.0), out)
    momentum, energy = abs(kept.momentum), abs(kept.energy)
    return f"{'':10} {momentum:7.0e} relative drift of total momentum, {energy:.0e} of total energy\n"


def _seconds(call: Callable[[], Any]) -> float:
    began = time.perf_counter()
    call()
    return time.perf_counter() - began

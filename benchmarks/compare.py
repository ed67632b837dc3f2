"""How fast, beside what else one would use: every figure a ratio of medians, contestants interleaved in one process.

    python benchmarks/compare.py [--pairs 8000000] [--rounds 15]

OMP_WAIT_POLICY=passive is set, or the idle team of prange takes a core from whoever runs next. All contestants write
to arrays that are given, except NumPy, whose expression allocates.
"""

import argparse
import os
import platform
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

os.environ["OMP_WAIT_POLICY"] = "passive"

import numba
import numpy as np

import collide
from collide._arrays import resolve
from collide._demo import numpy_2d, numpy_polar, random_pairs
from collide._limit import CARTESIAN_LIMIT, POLAR_LIMIT

OPTIONS = {"error_model": "numpy", "parallel": True}


@numba.njit(**OPTIONS)
def prange_2d(m1, m2, v1x, v1y, v2x, v2y, nx, ny, u1x, u1y, u2x, u2y):
    """The vector form in its plainest shape, without any guard: the fastest that prange can be."""
    for k in numba.prange(m1.size):
        dx, dy = nx[k], ny[k]
        q = 2.0 * ((v1x[k] - v2x[k]) * dx + (v1y[k] - v2y[k]) * dy) / ((m1[k] + m2[k]) * (dx * dx + dy * dy))
        j1, j2 = m2[k] * q, m1[k] * q
        u1x[k], u1y[k] = v1x[k] - j1 * dx, v1y[k] - j1 * dy
        u2x[k], u2y[k] = v2x[k] + j2 * dx, v2y[k] + j2 * dy


@numba.njit(**OPTIONS)
def prange_same_2d(m1, m2, v1x, v1y, v2x, v2y, nx, ny, u1x, u1y, u2x, u2y):
    """The library's own formula, with its guards over the whole floating-point range and its restitution."""
    for k in numba.prange(m1.size):
        u1x[k], u1y[k], u2x[k], u2y[k] = collide.scalar.resolve_2d(
            m1[k], m2[k], v1x[k], v1y[k], v2x[k], v2y[k], nx[k], ny[k]
        )


@numba.njit(**OPTIONS)
def prange_polar(m1, m2, v1, theta1, v2, theta2, phi, u1x, u1y, u2x, u2y):
    for k in numba.prange(m1.size):
        c, s = np.cos(phi[k]), np.sin(phi[k])
        ax, ay = v1[k] * np.cos(theta1[k]), v1[k] * np.sin(theta1[k])
        bx, by = v2[k] * np.cos(theta2[k]), v2[k] * np.sin(theta2[k])
        q = 2.0 * ((ax - bx) * c + (ay - by) * s) / (m1[k] + m2[k])
        j1, j2 = m2[k] * q, m1[k] * q
        u1x[k], u1y[k], u2x[k], u2y[k] = ax - j1 * c, ay - j1 * s, bx + j2 * c, by + j2 * s


def medians(contestants, rounds, repeat=1):
    """The median seconds of each contestant, interleaved; those named NumPy sit out most rounds if they are slow."""
    times = {name: [] for name in contestants}
    for contestant in contestants.values():
        contestant()
    for i in range(rounds):
        for name, contestant in contestants.items():
            if "NumPy" in name and i >= 3 and times[name][0] > 0.1:
                continue
            began = time.perf_counter()
            for _ in range(repeat):
                contestant()
            times[name].append((time.perf_counter() - began) / repeat)
    return {name: statistics.median(t) for name, t in times.items()}


def show(title, n, result, against="collide"):
    print(f"\n{title}")
    for name, seconds in result.items():
        rate = f"{n / seconds / 1e6:8.1f} M pairs/s" if n > 1 else f"{seconds * 1e6:8.1f} us       "
        print(f"  {name:36} {rate}   {against} is {seconds / result[against]:6.2f} x as fast")


def large_cartesian(n, rounds):
    cartesian, _ = random_pairs(n)
    out = tuple(np.zeros(n) for _ in range(4))
    result = medians(
        {
            "bytes only": lambda: resolve(CARTESIAN_LIMIT, (*cartesian, 1.0), False, "raise", out),
            "collide": lambda: collide.resolve_2d(*cartesian, out=out),
            "collide, scalar masses": lambda: collide.resolve_2d(1.0, 2.0, *cartesian[2:], out=out),
            "Numba prange, plain formula": lambda: prange_2d(*cartesian, *out),
            "Numba prange, collide.scalar": lambda: prange_same_2d(*cartesian, *out),
            "NumPy": lambda: numpy_2d(*cartesian),
        },
        rounds,
    )
    show(f"Cartesian, {n:,} pairs, float64", n, result)
    print(f"  of the memory limit: {result['bytes only'] / result['collide']:.2f}")
    singles = [c.astype(np.float32) for c in cartesian]
    single_out = tuple(np.zeros(n, np.float32) for _ in range(4))
    both = medians(
        {
            "collide": lambda: collide.resolve_2d(*cartesian, out=out),
            "collide, float32": lambda: collide.resolve_2d(*singles, out=single_out),
            "bytes only, float32": lambda: resolve(CARTESIAN_LIMIT, (*singles, 1.0), False, "raise", single_out),
        },
        rounds,
    )
    show("Cartesian, float32 storage", n, both, "collide, float32")


def large_polar(n, rounds):
    _, polar = random_pairs(n)
    out = tuple(np.zeros(n) for _ in range(4))
    singles = [c.astype(np.float32) for c in polar]
    single_out = tuple(np.zeros(n, np.float32) for _ in range(4))
    result = medians(
        {
            "bytes only": lambda: resolve(POLAR_LIMIT, (*polar, 1.0), False, "raise", out),
            "collide": lambda: collide.resolve_polar(*polar, out=out),
            "collide, float32": lambda: collide.resolve_polar(*singles, out=single_out),
            "Numba prange with libm": lambda: prange_polar(*polar, *out),
            "NumPy, the textbook's formula": lambda: numpy_polar(*polar),
        },
        rounds,
    )
    show(f"polar, {n:,} pairs, float64", n, result)
    print(f"  of the memory limit: {result['bytes only'] / result['collide']:.2f}")


def small(rounds):
    for n, threads in ((10_000, 1), (10_000, None), (100_000, None), (1_000_000, None)):
        cartesian, polar = random_pairs(n)
        out = tuple(np.zeros(n) for _ in range(4))
        before = collide.get_num_threads(), numba.get_num_threads()
        if threads:
            collide.set_num_threads(threads)
            numba.set_num_threads(threads)
        repeat = max(1, 1_000_000 // n)
        result = medians(
            {
                "collide": lambda cartesian=cartesian, out=out: collide.resolve_2d(*cartesian, out=out),
                "Numba prange, plain formula": lambda cartesian=cartesian, out=out: prange_2d(*cartesian, *out),
                "Numba prange, collide.scalar": lambda cartesian=cartesian, out=out: prange_same_2d(*cartesian, *out),
                "NumPy": lambda cartesian=cartesian: numpy_2d(*cartesian),
            },
            rounds,
            repeat,
        )
        show(f"Cartesian, {n:,} pairs, {threads or 'all'} thread(s)", n, result)
        result = medians(
            {
                "collide": lambda polar=polar, out=out: collide.resolve_polar(*polar, out=out),
                "Numba prange with libm": lambda polar=polar, out=out: prange_polar(*polar, *out),
            },
            rounds,
            max(1, repeat // 10),
        )
        show(f"polar, {n:,} pairs, {threads or 'all'} thread(s)", n, result)
        collide.set_num_threads(before[0])
        numba.set_num_threads(before[1])
    cartesian, polar = random_pairs(1)
    out = tuple(np.zeros(1) for _ in range(4))
    result = medians(
        {
            "collide": lambda: collide.resolve_2d(*cartesian),
            "NumPy": lambda: numpy_2d(*cartesian),
            "collide, out given": lambda: collide.resolve_2d(*cartesian, out=out),
            "collide, polar": lambda: collide.resolve_polar(*polar),
            "NumPy, polar": lambda: numpy_polar(*polar),
        },
        rounds,
        2000,
    )
    show("one pair, arrays of length 1", 1, result)


def start(rounds=9):
    """Seconds in new processes: the import over numba's, and the first call, cached, over Numba's own."""
    programs = {
        "import numba": "import time; t = time.perf_counter(); import numba; print(time.perf_counter() - t)",
        "import numba, collide": (
            "import time; t = time.perf_counter(); import numba, collide; print(time.perf_counter() - t)"
        ),
        "Numba's first call, cached": (
            "import sys; sys.path.insert(0, {folder!r}); import trivial, time; "
            "t = time.perf_counter(); trivial.f(1.0); print(time.perf_counter() - t)"
        ),
        "collide's first call, cached": (
            "import collide, numpy as np, time; a = [np.ones(1)] * 8; "
            "t = time.perf_counter(); collide.resolve_2d(*a); print(time.perf_counter() - t)"
        ),
    }
    with tempfile.TemporaryDirectory() as folder:
        text = "import numba\n\n@numba.njit(cache=True)\ndef f(x):\n    return x + 1.0\n"
        (Path(folder) / "trivial.py").write_text(text)
        times = {name: [] for name in programs}
        for i in range(rounds + 1):
            for name, program in programs.items():
                command = [sys.executable, "-c", program.replace("{folder!r}", repr(folder))]
                run = subprocess.run(command, capture_output=True, text=True, check=True)
                if i:  # the first round fills the caches
                    times[name].append(float(run.stdout))
    print()
    for name, t in times.items():
        print(f"  {name:36} {statistics.median(t):8.3f} s")


def processor():
    try:
        return next(line for line in Path("/proc/cpuinfo").read_text().splitlines() if "model name" in line).split(
            ": "
        )[1]
    except (OSError, StopIteration):
        return platform.machine()


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--pairs", type=int, default=8_000_000)
    parser.add_argument("--rounds", type=int, default=15)
    options = parser.parse_args()
    print(f"{processor()}, {collide.get_num_threads()} threads; Python {platform.python_version()}, ", end="")
    print(f"NumPy {np.__version__}, Numba {numba.__version__}; medians of {options.rounds} interleaved rounds")
    large_cartesian(options.pairs, options.rounds)
    large_polar(options.pairs, options.rounds)
    small(options.rounds)
    start()


if __name__ == "__main__":
    main()

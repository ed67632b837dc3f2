"""What else one would use, on the same arrays: each yardstick makes, for a case, a call that resolves its pairs.

A yardstick that is not installed, or has no such case, says so by `MissingError`. All of them write to the arrays that
they are given, except NumPy and JAX, which allocate as their users would have them do.
"""

from __future__ import annotations

import ctypes
import dataclasses
import functools
import importlib
import math
import os
import shutil
import statistics
import subprocess
import tempfile
import warnings
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numba
import numpy as np

import collide
from collide._cli.demo import numpy_2d, numpy_polar, random_pairs
from collide._cli.limit import LIMITS
from collide._pairs.execution import resolve

Array = np.ndarray[Any, np.dtype[Any]]
FORMS = ("line", "plane", "polar", "impact")
FUNCTIONS: dict[str, Callable[..., Any]] = {
    "line": collide.resolve_1d,
    "plane": collide.resolve_2d,
    "polar": collide.resolve_polar,
    "impact": collide.time_of_impact,
}


RESULTS = {"line": 2, "plane": 4, "polar": 4, "impact": 1}


class MissingError(Exception):
    """Why a yardstick cannot run a case here."""


@dataclasses.dataclass(frozen=True)
class Case:
    """Pairs in one form, arrays for the results, and how many threads may work."""

    form: str
    n: int
    threads: int
    columns: tuple[Array, ...]
    out: tuple[Array, ...]


@functools.lru_cache(maxsize=1)  # 10^7 pairs take 1.9 GB with their results
def arrays(form: str, n: int) -> tuple[tuple[Array, ...], tuple[Array, ...]]:
    """Seeded pairs in one form, and arrays for their results."""
    if form == "impact":
        rng = np.random.default_rng(0)
        columns = [*rng.uniform(-50.0, 50.0, (2, n)), *rng.normal(size=(2, n)), rng.uniform(1.0, 2.0, n)]
    else:
        cartesian, polar = random_pairs(n)
        m1, m2, v1x, _, v2x, *_ = cartesian
        columns = {"line": [m1, m2, v1x, v2x], "plane": cartesian, "polar": polar}[form]
    return tuple(c.copy() for c in columns), tuple(np.zeros(n) for _ in range(RESULTS[form]))


def make_case(form: str, n: int) -> Case:
    """For as many threads as collide has at this moment."""
    return Case(form, n, collide.get_num_threads(), *arrays(form, n))


def spells(ratios: list[float], rounds: int) -> list[float]:
    """The median of each third of `rounds`."""
    size = rounds // 3
    return [statistics.median(ratios[i : i + size]) for i in range(0, len(ratios) - size + 1, size)]


def calls_a_round(n: int, seconds: float = 2.5e-9) -> int:
    """How many calls of n elements, of so many seconds each, a round has: some 2 ms of collide's.

    Short calls are timed many at a time; a long one has left the caches before it ends. It follows from the case alone:
    if it were measured, two runs would compare rounds of different lengths.
    """
    return max(1, round(2e-3 / (5e-6 + seconds * n)))


Call = Callable[[], Sequence[Array]]


def collide_itself(case: Case) -> Call:
    function = FUNCTIONS[case.form]
    if RESULTS[case.form] == 1:
        return lambda: (function(*case.columns, out=case.out[0]),)
    return lambda: function(*case.columns, out=case.out)  # type: ignore[no-any-return]


def bytes_only(case: Case) -> Call:
    """The memory limit: the same loads and stores, and next to no arithmetic."""
    form = LIMITS[{"line": "1d", "plane": "2d"}.get(case.form, case.form)]
    columns = case.columns if case.form == "impact" else (*case.columns, 1.0)
    return lambda: resolve(form, columns, False, "raise", case.out)


def numpy_1d(m1: Any, m2: Any, v1: Any, v2: Any) -> Any:
    q = 2.0 * (v1 - v2) / (m1 + m2)
    return v1 - m2 * q, v2 + m1 * q


def numpy_impact(dx: Any, dy: Any, dvx: Any, dvy: Any, distance: Any) -> Any:
    """The textbook's discriminant, which loses near a graze what collide keeps."""
    b, square = dx * dvx + dy * dvy, dvx * dvx + dvy * dvy
    gap = dx * dx + dy * dy - distance * distance
    under = b * b - square * gap
    t = (-b - np.sqrt(np.maximum(under, 0.0))) / square
    return (np.where((b < 0.0) & (under >= 0.0), np.maximum(t, 0.0), np.inf),)


def numpy_expression(case: Case) -> Call:
    """Always on one thread."""
    function = {"line": numpy_1d, "plane": numpy_2d, "polar": numpy_polar, "impact": numpy_impact}[case.form]
    return lambda: function(*case.columns)


OPTIONS = {"error_model": "numpy", "parallel": True}


@numba.njit(**OPTIONS)
def prange_line(m1, m2, v1, v2, u1, u2):
    for k in numba.prange(m1.size):
        q = 2.0 * (v1[k] - v2[k]) / (m1[k] + m2[k])
        u1[k], u2[k] = v1[k] - m2[k] * q, v2[k] + m1[k] * q


@numba.njit(**OPTIONS)
def prange_plane(m1, m2, v1x, v1y, v2x, v2y, nx, ny, u1x, u1y, u2x, u2y):
    for k in numba.prange(m1.size):
        dx, dy = nx[k], ny[k]
        q = 2.0 * ((v1x[k] - v2x[k]) * dx + (v1y[k] - v2y[k]) * dy) / ((m1[k] + m2[k]) * (dx * dx + dy * dy))
        j1, j2 = m2[k] * q, m1[k] * q
        u1x[k], u1y[k] = v1x[k] - j1 * dx, v1y[k] - j1 * dy
        u2x[k], u2y[k] = v2x[k] + j2 * dx, v2y[k] + j2 * dy


@numba.njit(**OPTIONS)
def prange_polar(m1, m2, v1, theta1, v2, theta2, phi, u1x, u1y, u2x, u2y):
    for k in numba.prange(m1.size):
        c, s = np.cos(phi[k]), np.sin(phi[k])
        ax, ay = v1[k] * np.cos(theta1[k]), v1[k] * np.sin(theta1[k])
        bx, by = v2[k] * np.cos(theta2[k]), v2[k] * np.sin(theta2[k])
        q = 2.0 * ((ax - bx) * c + (ay - by) * s) / (m1[k] + m2[k])
        j1, j2 = m2[k] * q, m1[k] * q
        u1x[k], u1y[k], u2x[k], u2y[k] = ax - j1 * c, ay - j1 * s, bx + j2 * c, by + j2 * s


@numba.njit(**OPTIONS)
def prange_impact(dx, dy, dvx, dvy, distance, t):
    for k in numba.prange(t.size):
        b = dx[k] * dvx[k] + dy[k] * dvy[k]
        square = dvx[k] * dvx[k] + dvy[k] * dvy[k]
        under = b * b - square * (dx[k] * dx[k] + dy[k] * dy[k] - distance[k] * distance[k])
        t[k] = np.inf
        if b < 0.0 and under >= 0.0:
            t[k] = max(0.0, (-b - np.sqrt(under)) / square)


@numba.njit(**OPTIONS)
def same_impact(dx, dy, dvx, dvy, distance, t):
    for k in numba.prange(t.size):
        t[k] = collide.scalar.time_of_impact(dx[k], dy[k], dvx[k], dvy[k], distance[k])


@numba.njit(**OPTIONS)
def same_line(m1, m2, v1, v2, u1, u2):
    for k in numba.prange(m1.size):
        u1[k], u2[k] = collide.scalar.resolve_1d(m1[k], m2[k], v1[k], v2[k])


@numba.njit(**OPTIONS)
def same_plane(m1, m2, v1x, v1y, v2x, v2y, nx, ny, u1x, u1y, u2x, u2y):
    for k in numba.prange(m1.size):
        u1x[k], u1y[k], u2x[k], u2y[k] = collide.scalar.resolve_2d(
            m1[k], m2[k], v1x[k], v1y[k], v2x[k], v2y[k], nx[k], ny[k]
        )


def prange_plain(case: Case) -> Call:
    """Numba's parallel loop over the plain formula, in polar form with libm: the fastest that prange can be."""
    loops = {"line": prange_line, "plane": prange_plane, "polar": prange_polar, "impact": prange_impact}
    return _prange(loops[case.form], case)


def prange_same(case: Case) -> Call:
    """Numba's parallel loop over the library's own formula, with its guards for numbers of any size."""
    if case.form == "polar":
        raise MissingError("the library's sine in a scalar loop is no contestant in polar form")
    return _prange({"line": same_line, "plane": same_plane, "impact": same_impact}[case.form], case)


def _prange(function: Any, case: Case) -> Call:
    def call() -> Sequence[Array]:
        numba.set_num_threads(case.threads)
        function(*case.columns, *case.out)
        return case.out

    return call


@functools.cache
def _c_library() -> ctypes.CDLL:
    compiler = shutil.which("cc")
    if compiler is None:
        raise MissingError("no C compiler (cc) was found")
    source = Path(__file__).parent / "loops.c"
    with tempfile.TemporaryDirectory() as folder:
        library = Path(folder) / "loops.so"
        flags = ["-O3", "-march=native", "-fopenmp", "-shared", "-fPIC"]
        run = subprocess.run(
            [compiler, *flags, str(source), "-o", str(library), "-lm"], capture_output=True, text=True, check=False
        )
        if run.returncode:
            raise MissingError(f"cc could not compile loops.c with OpenMP: {run.stderr.strip().splitlines()[-1]}")
        return ctypes.CDLL(str(library))


def c_loop(case: Case) -> Call:
    """cc -O3 -march=native -fopenmp, the plain formula."""
    if case.form == "impact":
        raise MissingError("measured on collisions only")
    function = getattr(_c_library(), case.form)
    pointers = [ctypes.c_void_p(a.ctypes.data) for a in (*case.columns, *case.out)]

    def call() -> Sequence[Array]:
        function(ctypes.c_long(case.n), ctypes.c_int(case.threads), *pointers)
        return case.out

    return call


@functools.cache
def peer(name: str) -> Any:
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return importlib.import_module(name)
    except ImportError:
        raise MissingError(f'{name} is not installed: pip install -e ".[peers]"') from None


def _all_threads_only(case: Case) -> None:
    if case.form == "impact":
        raise MissingError("measured on collisions only")
    if case.threads < numba.config.NUMBA_NUM_THREADS:
        raise MissingError("measured on all threads only")


NUMEXPR = {
    "line": ["v1 - m2 * (2 * (v1 - v2) / (m1 + m2))", "v2 + m1 * (2 * (v1 - v2) / (m1 + m2))"],
    "plane": ["v1x - m2 * q * nx", "v1y - m2 * q * ny", "v2x + m1 * q * nx", "v2y + m1 * q * ny"],
    "polar": [
        "v1 * cos(theta1) - m2 * q * cos(phi)",
        "v1 * sin(theta1) - m2 * q * sin(phi)",
        "v2 * cos(theta2) + m1 * q * cos(phi)",
        "v2 * sin(theta2) + m1 * q * sin(phi)",
    ],
}
NUMEXPR_Q = {
    "plane": "2 * ((v1x - v2x) * nx + (v1y - v2y) * ny) / ((m1 + m2) * (nx * nx + ny * ny))",
    "polar": "2 * (v1 * cos(theta1 - phi) - v2 * cos(theta2 - phi)) / (m1 + m2)",
}
NAMES = {
    "line": ["m1", "m2", "v1", "v2"],
    "plane": ["m1", "m2", "v1x", "v1y", "v2x", "v2y", "nx", "ny"],
    "polar": ["m1", "m2", "v1", "theta1", "v2", "theta2", "phi"],
}


def numexpr(case: Case) -> Call:
    """What has no place of its own, the factor common to all results, is evaluated once."""
    _all_threads_only(case)
    ne = peer("numexpr")
    ne.set_num_threads(case.threads)
    names = dict(zip(NAMES[case.form], case.columns, strict=True))

    def call() -> Sequence[Array]:
        if case.form != "line":
            names["q"] = ne.evaluate(NUMEXPR_Q[case.form], names)
        for expression, u in zip(NUMEXPR[case.form], case.out, strict=True):
            ne.evaluate(expression, names, out=u)
        return case.out

    return call


def jax(case: Case) -> Call:
    """The NumPy expressions under jax.jit, inputs already on its device, which is the processor."""
    _all_threads_only(case)
    os.environ.setdefault("JAX_PLATFORMS", "cpu")
    jax = peer("jax")
    jnp = peer("jax.numpy")
    jax.config.update("jax_enable_x64", True)

    def plane_from_polar(m1: Any, m2: Any, v1: Any, theta1: Any, v2: Any, theta2: Any, phi: Any) -> Any:
        ax, ay, bx, by = v1 * jnp.cos(theta1), v1 * jnp.sin(theta1), v2 * jnp.cos(theta2), v2 * jnp.sin(theta2)
        return numpy_2d(m1, m2, ax, ay, bx, by, jnp.cos(phi), jnp.sin(phi))

    function = jax.jit({"line": numpy_1d, "plane": numpy_2d, "polar": plane_from_polar}[case.form])
    inputs = [jax.device_put(c) for c in case.columns]
    return lambda: jax.block_until_ready(function(*inputs))  # type: ignore[no-any-return]


@functools.cache
def _taichi_kernels() -> dict[str, Any]:
    ti = peer("taichi")
    ti.init(arch=ti.cpu, default_fp=ti.f64, cpu_max_num_threads=collide.get_num_threads(), log_level=ti.ERROR)
    return importlib.import_module("taichi_kernels").KERNELS  # type: ignore[no-any-return]


def taichi(case: Case) -> Call:
    _all_threads_only(case)
    kernel = _taichi_kernels()[case.form]

    def call() -> Sequence[Array]:
        kernel(*case.columns, *case.out)
        return case.out

    return call


def pymunk(case: Case) -> Call:
    """A physics engine: n isolated touching pairs of disks, one step. It finds the contacts too.

    On one thread: its threaded solver gives wrong velocities at one iteration, from some thousands of pairs on.
    """
    _all_threads_only(case)
    if case.form != "plane" or case.n > 10_000:
        raise MissingError("an engine is asked for pairs in the plane, up to 10,000")
    pm = peer("pymunk")
    space = pm.Space()
    space.iterations = 1
    m1, m2, v1x, v1y, v2x, v2y, nx, ny = case.columns
    bodies = []
    side = math.isqrt(case.n) + 1
    # Touching: a thousandth of a radius of overlap, which the solver leaves alone. Radius 1/2, 4 apart.
    length = np.hypot(nx, ny) / 0.999
    for k in range(case.n):
        for m, x, y in ((m1[k], 0.0, 0.0), (m2[k], nx[k] / length[k], ny[k] / length[k])):
            body = pm.Body(m, math.inf)
            body.position = 4.0 * (k % side) + x, 4.0 * (k // side) + y
            shape = pm.Circle(body, 0.5)
            shape.elasticity = 1.0
            space.add(body, shape)
            bodies.append(body)
    places = [body.position for body in bodies]
    velocities = np.stack([v1x, v1y, v2x, v2y], 1).reshape(-1, 2).tolist()

    def step() -> Sequence[Array]:
        space.step(1e-9)
        return case.out

    def reset() -> None:
        for body, place, velocity in zip(bodies, places, velocities, strict=True):
            body.position, body.velocity = place, velocity

    def answer() -> Sequence[Array]:
        return tuple(np.array([body.velocity for body in bodies]).reshape(-1, 4).T)

    step.reset, step.answer = reset, answer  # type: ignore[attr-defined]
    return step


YARDSTICKS: dict[str, Callable[[Case], Call]] = {
    "collide": collide_itself,
    "bytes only": bytes_only,
    "prange": prange_plain,
    "prange, same formula": prange_same,
    "C": c_loop,
    "NumPy": numpy_expression,
    "numexpr": numexpr,
    "JAX": jax,
    "Taichi": taichi,
    "pymunk": pymunk,
}

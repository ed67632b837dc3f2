"""Contract 2 across processors: the same bits with AVX-512, AVX2 and SSE2, held by digests that stand here.

Those of the inputs stand beside those of the results: where both differ, the inputs are at fault. After a change of
either that is meant, `python -m tests.compile.test_processors` prints the new GOLDEN.
"""

import ast
import hashlib
import pprint
import re
import sys
from pathlib import Path

import llvmlite.binding
import numpy as np
import pytest

import collide
from tests.helpers import pairs, process
from tests.helpers.sizes import sizes

ROOT = Path(__file__).parents[2]
N = 100_000
# Of the inputs, and of the results.
GOLDEN = {
    "resolve_1d": ("df80bc32d9b0d790", "a315bcd5ed4ff517"),
    "resolve_2d": ("d73d6f2ef625ae69", "2292e17a2569013e"),
    "resolve_3d": ("ca059306742bfd6b", "eccd6788437fdcaa"),
    "resolve_polar": ("3b401eb4c8889cb9", "a4b0ae30b43f0194"),
    "impulse_2d": ("d73d6f2ef625ae69", "5728a00168ec71a3"),
    "impulse_3d": ("ca059306742bfd6b", "8f9087c6eee720b1"),
    "time_of_impact": ("c4b3ca919c15f413", "c26838aeceead43d"),
    "time_of_impact_3d": ("34e119a5013cebff", "cbbe54ecee05ef42"),
    "find_contacts": ("2e73d3f86e5c4e39", "9fd92fed33ba52e7"),
    "find_contacts, few": ("b4b3d858951456d1", "0ab9b773ee24b6cd"),
    "resolve_contacts": ("d8c804be80ccc6ad", "058e41316b7a8645"),
    "resolve_contacts of float32 with radii": ("d8c804be80ccc6ad", "3ac044c3791fafae"),
    "resolve_pairs": ("82018196bdde87e4", "ee2fe08129fd0aec"),
    "resolve_walls": ("d8c804be80ccc6ad", "b6c912a6bc6b9388"),
}


def case(name):
    """The inputs, 100,000 pairs of every size, some of them invalid, or 100,000 balls; and the results."""
    if name.startswith("impulse") or name in ("resolve_1d", "resolve_2d", "resolve_3d", "resolve_polar"):
        draw = pairs.polar if name == "resolve_polar" else pairs.space if name.endswith("3d") else pairs.plane
        c = draw(N, 5)
        c = (*c[:4], c[-1]) if name == "resolve_1d" else c
        u = getattr(collide, name)(*c[:-1], restitution=c[-1], invalid="nan")
        return c, u if isinstance(u, tuple) else [u]
    rng = np.random.default_rng(5)
    if name.startswith("time_of_impact"):
        c = *pairs.uniform(rng, -9, 9, (6 if name.endswith("3d") else 4, N)), pairs.uniform(rng, 0, 5, N)
        return c, [getattr(collide, name)(*c)]
    if name == "resolve_pairs":
        i, m, (v, n) = rng.integers(0, N, N), pairs.uniform(rng, 1, 9, N), pairs.uniform(rng, -1, 1, (2, 3, N))
        j, plane, space, impulses = (
            (i + rng.integers(1, N, N)) % N,
            v[:2].copy(),
            v.astype(np.float32),
            np.empty((2, N)),
        )
        for u, impulse in ((plane, impulses[0]), (space, impulses[1])):
            collide.resolve_pairs(i, j, m, tuple(u), tuple(n[: len(u)]), restitution=0.7, impulse=impulse)
        return (i, j, m, v, n), [plane, space, impulses]
    if name == "find_contacts, few":
        (x, y), radius = pairs.uniform(rng, 0, 70, (2, 1000)), 0.02 * rng.integers(1, 60, 1000)
        return (x, y, radius), collide.find_contacts(x, y, radius, box=(70, None), margin=0.25)
    x, y = pairs.uniform(rng, 0, 700, (2, N))
    radius = 0.02 * rng.integers(1, 60, N)
    i, j = collide.find_contacts(x, y, radius, box=(700, 700), margin=0.25)
    if name == "find_contacts":
        return (x, y, radius), [i, j]
    velocities = pairs.uniform(rng, -1, 1, (2, N))
    if name == "resolve_walls":
        (vx, vy), impulse = velocities.copy(), np.zeros(4)
        collide.resolve_walls(x, y, vx, vy, 50 * radius, (700, 700), m=radius, restitution=0.7, impulse=impulse)
        return (x, y, radius, velocities), [vx, vy, impulse]
    (vx, vy), impulse = velocities.astype(np.float32 if "float32" in name else np.float64), np.empty(i.size)
    options = {"restitution": 0.7, "box": (700, 700), "impulse": impulse}
    options |= {"radius": radius} if "radii" in name else {}
    collide.resolve_contacts(i, j, radius, x, y, vx, vy, **options)
    return (x, y, radius, velocities), [vx, vy, impulse]


def digest(arrays):
    found = hashlib.sha256()
    for a in arrays:
        found.update(np.where(a != a, np.nan, a).tobytes())  # one NaN for all
    return found.hexdigest()[:16]


def digests(names):
    return {name: tuple(map(digest, case(name))) for name in names}


@pytest.mark.parametrize("name", GOLDEN)
def test_the_digests_on_this_processor(name):
    assert digests([name]) == {name: GOLDEN[name]}


# What each level goes without, of the features that LLVM and NumPy know of this machine.
ALL = "."
LEVELS = {
    "baseline": ALL,
    "without AVX2": r"avx|fma|f16c|xop|x86_v[34]",
    "without AVX-512": r"avx-?512|avx10|x86_v4",
}


def without(features):
    """The variables that take these from Numba and from NumPy, whose ufuncs make the inputs."""

    def matching(names):
        return [name for name in names if re.match(features, name, re.IGNORECASE)]

    # NumPy refuses to go without its baseline, and warns of what the machine does not have: "found" is the rest.
    found = np.show_config("dicts")["SIMD Extensions"].get("found", [])
    numpy = {"NPY_DISABLE_CPU_FEATURES": " ".join(matching(found))}
    if features == ALL:
        return {**numpy, "NUMBA_CPU_NAME": "generic", "NUMBA_CPU_FEATURES": ""}
    host = llvmlite.binding.get_host_cpu_features()
    return {**numpy, "NUMBA_CPU_FEATURES": ",".join(f"-{name}" for name in matching(host))}


@pytest.mark.parametrize(
    "level", ["baseline", "without AVX-512", pytest.param("without AVX2", marks=pytest.mark.campaign)]
)
@sizes(usual=["resolve_2d"], campaign=[*GOLDEN])
def test_the_digests_on_others(level, size):
    env = process.environment(**without(LEVELS[level]))
    done = process.run(sys.executable, "-m", __name__, *size, cwd=ROOT, env=env, timeout=600)
    assert (done.returncode, done.stderr) == (0, "")
    assert ast.literal_eval(done.stdout) == {name: GOLDEN[name] for name in size}


if __name__ == "__main__":
    pprint.pprint(digests(sys.argv[1:] or GOLDEN), sort_dicts=False)

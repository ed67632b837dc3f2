"""Contract 2 across processors: the same bits with AVX-512, AVX2 and SSE2, held by digests that stand here."""

import hashlib
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pairs
import pytest

import collide

N = 100_000
GOLDEN = {
    "resolve_1d": "979d1c00e0ce05ea",
    "resolve_2d": "6484537fb6d692ca",
    "resolve_polar": "55d900dca5ceef4d",
    "impulse_2d": "aac5c26b00c38021",
    "time_of_impact": "902adb3abbd9b074",
    "find_contacts": "9fd92fed33ba52e7",
    "resolve_contacts": "8a5678ac62ed0546",
}


def answers(name):
    """The results of 100,000 pairs of every size, some of them invalid."""
    if name in ("resolve_polar", "resolve_1d", "resolve_2d", "impulse_2d"):
        c = pairs.polar(N, 5) if name == "resolve_polar" else pairs.cartesian(N, 5)
        c = (*c[:4], c[-1]) if name == "resolve_1d" else c
        u = getattr(collide, name)(*c[:-1], restitution=c[-1], invalid="nan")
        return u if isinstance(u, tuple) else [u]
    rng = np.random.default_rng(5)
    if name == "time_of_impact":
        return [collide.time_of_impact(*rng.uniform(-9, 9, (4, N)), rng.uniform(0, 5, N))]
    x, y = rng.uniform(0, 700, (2, N))
    radius = 0.02 * rng.integers(1, 60, N)
    i, j = collide.find_contacts(x, y, radius, box=(700, 700), margin=0.25)
    if name == "find_contacts":
        return [i, j]
    vx, vy = rng.uniform(-1, 1, (2, N))
    impulse = np.empty(i.size)
    collide.resolve_contacts(i, j, radius, x, y, vx, vy, restitution=0.7, box=(700, 700), impulse=impulse)
    return [vx, vy, impulse]


def digest(name):
    found = hashlib.sha256()
    for u in answers(name):
        found.update(np.where(u != u, np.nan, u).tobytes())  # one NaN for all
    return found.hexdigest()[:16]


def test_the_digests_on_this_processor():
    assert {name: digest(name) for name in GOLDEN} == GOLDEN


AVX512 = "-avx512f,-avx512cd,-avx512bw,-avx512dq,-avx512vl,-avx512ifma,-avx512vbmi,-avx512vbmi2,-avx512vnni,"
AVX512 += "-avx512bitalg,-avx512vpopcntdq,-avx512bf16,-avx512fp16,-avx512vp2intersect"


@pytest.mark.parametrize(
    "variables",
    [
        {"NUMBA_CPU_NAME": "generic", "NUMBA_CPU_FEATURES": ""},
        {"NUMBA_CPU_FEATURES": AVX512},
        {"NUMBA_CPU_FEATURES": f"{AVX512},-avx2,-fma,-avx"},
    ],
    ids=["generic", "without AVX-512", "without AVX2"],
)
def test_the_digests_on_others(variables):
    here = Path(__file__).parent
    environment = {**os.environ, "PYTHONPATH": f"{here}:{Path(collide.__file__).parents[1]}", **variables}
    code = "import conftest, test_processors as t; print({name: t.digest(name) for name in t.GOLDEN})"
    done = subprocess.run(
        [sys.executable, "-c", code], env=environment, capture_output=True, text=True, timeout=600, check=False
    )
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout == f"{GOLDEN}\n"

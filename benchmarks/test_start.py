"""What a new process waits for: imports and first calls, each beside Numba's own. Whole processes are timed."""

from __future__ import annotations

import os
import statistics
import subprocess
import sys

import pytest

TRIVIAL = "import numba\n\n@numba.njit(cache=True)\ndef f(x):\n    return x + 1.0\n"
CLOCK = "import time; began = time.perf_counter(); {}; print(time.perf_counter() - began)"
PAIR = "a = [np.ones(1)] * 8; " + CLOCK.format("collide.resolve_2d(*a)")
PROGRAMS = {
    "import numba": CLOCK.format("import numba"),
    "import numba and collide": CLOCK.format("import numba, collide"),
    "trivial, cached": "import trivial; " + CLOCK.format("trivial.f(1.0)"),
    "collide, cached": "import collide, numpy as np; " + PAIR,
    "collide, compiling": "import collide, numpy as np; " + PAIR,
}


@pytest.mark.parametrize("name", PROGRAMS)
def test_start(benchmark, tmp_path, name):
    (tmp_path / "trivial.py").write_text(TRIVIAL)
    compiling = name.endswith("compiling")
    seconds = []
    folders = (tmp_path / f"cache {i}" for i in range(100))
    environment = {**os.environ, "PYTHONPATH": str(tmp_path), "NUMBA_CACHE_DIR": str(next(folders))}

    def process():
        if compiling:
            environment["NUMBA_CACHE_DIR"] = str(next(folders))
        command = [sys.executable, "-c", PROGRAMS[name]]
        run = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
        seconds.append(float(run.stdout))

    benchmark.group = "start of a process"
    rounds = 2 if compiling else 5
    benchmark.pedantic(process, rounds=rounds, warmup_rounds=0 if compiling else 1)
    benchmark.extra_info.update(start=name, seconds=statistics.median(seconds[-rounds:]))

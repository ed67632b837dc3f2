"""What every benchmark shares: the settings before Numba is imported, the race, and the summary at the end."""

from __future__ import annotations

import os

# Or the idle team of prange takes a core from whoever runs next.
os.environ.setdefault("OMP_WAIT_POLICY", "passive")

import statistics
import time
from collections.abc import Callable
from typing import Any

import numba
import numpy as np
import pytest

import collide

BUDGET = 0.8  # seconds of timed rounds, of a contestant and of collide beside it
PAUSE = 5  # seconds, in which a neighbour on the host may have gone
COLUMNS = ["min", "median", "iqr", "rounds", "iterations"]


def pytest_configure(config: pytest.Config) -> None:
    config.addinivalue_line("filterwarnings", "default")  # what a yardstick warns of is no failure of collide's
    if "s" not in config.option.reportchars:
        config.option.reportchars += "s"  # what was skipped, and why
    if hasattr(config.option, "benchmark_columns"):
        config.option.benchmark_columns = COLUMNS
        config.option.benchmark_sort = "median"


def pytest_report_header() -> str:
    return (
        f"collide: {collide.get_num_threads()} threads, NumPy {np.__version__}, Numba {numba.__version__}, "
        f"OMP_WAIT_POLICY={os.environ['OMP_WAIT_POLICY']} (an idle OpenMP team would take a core from the next one)"
    )


def pytest_benchmark_update_machine_info(config: pytest.Config, machine_info: dict[str, Any]) -> None:
    machine_info.pop("node", None)
    machine_info["collide threads"] = collide.get_num_threads()
    machine_info.update({"numpy": np.__version__, "numba": numba.__version__})
    machine_info["OMP_WAIT_POLICY"] = os.environ["OMP_WAIT_POLICY"]


@pytest.fixture
def set_threads() -> Any:
    """A function that sets the number of threads of collide; it is put back afterwards."""
    before = collide.get_num_threads()
    yield collide.set_num_threads
    collide.set_num_threads(before)


def _seconds(call: Callable[[], Any], calls: int) -> float:
    """Of one call."""
    began = time.perf_counter()
    for _ in range(calls):
        call()
    return (time.perf_counter() - began) / calls


@pytest.fixture
def race(benchmark: Any) -> Callable[..., list[float]]:
    """A function that times a contestant by pytest-benchmark, each round after one of the reference.

    Interleaved, so that what slows the machine down slows both, and each after an untimed call of its own, so that
    neither finds the caches as the other left them. A round has `calls` calls of either, and all times are of one call.
    Gives the ratio of each round, the reference's time to the contestant's, and leaves their median and what else it is
    told in the benchmark's extra_info. Where the ratios are not `enough`, as many rounds again are added after a pause,
    twice at most.
    """

    def run(
        contestant: Callable[[], Any],
        reference: Callable[[], Any],
        /,
        calls: int,
        rounds: int | None = None,
        enough: Callable[[list[float]], bool] = lambda ratios: True,
        **info: Any,
    ) -> list[float]:
        reset = getattr(contestant, "reset", None)
        if reset is None:
            contestant()
            once = _seconds(contestant, 1)
            prepare = contestant if once < 0.1 else reference
        else:
            reset()
            once, calls, prepare = _seconds(contestant, 1), 1, reset
        rounds = rounds or min(30, max(3, int(BUDGET / (calls * (once + _seconds(reference, 1))))))
        references: list[float] = []

        def before() -> None:
            reference()
            references.append(_seconds(reference, calls))
            prepare()

        before()
        # Each round's teardown makes the next one ready, as pytest-benchmark takes no setup where a round has several
        # calls; those after the last round are not looked at.
        benchmark.pedantic(contestant, teardown=before, rounds=rounds, iterations=calls)
        data = benchmark.stats.stats.data
        ratios = [r / c for r, c in zip(references, data, strict=False)]
        for _ in range(2):
            if not enough(ratios):
                time.sleep(PAUSE)
                for _ in range(rounds):
                    before()
                    ratios.append(references[-1] / _seconds(contestant, calls))
        benchmark.extra_info.update({**info, "as fast as the reference": statistics.median(ratios)})
        return ratios

    return run


def pytest_terminal_summary(terminalreporter: Any, config: pytest.Config) -> None:
    session = getattr(config, "_benchmarksession", None)
    benchmarks = [b for b in session.benchmarks if not b.has_error and "contestant" in b.extra_info] if session else []
    if not benchmarks:
        return
    write = terminalreporter.write_line
    terminalreporter.section("pairs a second, and how many times as fast as each contestant collide is")
    group = None
    for b in benchmarks:
        if b.group != group:
            group = b.group
            write(f"\n{group}")
        rate = b.extra_info["n"] / b.stats.median
        ratio = 1 / b.extra_info["as fast as the reference"]
        write(f"  {b.extra_info['contestant']:24} {rate / 1e6:10.4g} M pairs/s   {ratio:8.2f} x")

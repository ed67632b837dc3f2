"""What every benchmark shares: the settings before Numba is imported, the race, and the summary at the end."""

from __future__ import annotations

import os

# Or the idle team of prange takes a core from whoever runs next.
os.environ.setdefault("OMP_WAIT_POLICY", "passive")

import math
import shutil
import statistics
from collections.abc import Callable
from typing import Any

import make_pairs
import numba
import numpy as np
import pytest
from cases import FILE_PAIRS, STORE_PAIRS
from contestants import dask
from rounds import Rounds, Timed, seconds

import collide

BUDGET = 0.8  # seconds of timed rounds, of a contestant and of collide beside it
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


@pytest.fixture(scope="module", params=[".parquet", ""], ids=["Parquet", "folder"])
def source(request: Any, tmp_path_factory: Any) -> Any:
    """A table of pairs on disk, as a file and as a folder."""
    path = tmp_path_factory.mktemp("files") / f"pairs{request.param}"
    make_pairs.main(FILE_PAIRS, path)
    yield path
    shutil.rmtree(path.parent)


@pytest.fixture(scope="module")
def store(tmp_path_factory: Any) -> Any:
    """Columns of pairs on disk, and of their results."""
    folder = tmp_path_factory.mktemp("store") / "pairs"
    dask.make_store(STORE_PAIRS, folder)
    yield folder
    shutil.rmtree(folder)


@pytest.fixture(scope="module")
def clients() -> Any:
    """Of two worker processes of one thread each, and of one of two."""
    with dask.client(2, 1) as two, dask.client(1, 2) as one:
        yield two, one


@pytest.fixture
def race(benchmark: Any) -> Callable[..., float]:
    """A function that times a contestant by pytest-benchmark, each round after one of the reference: see `Rounds`.

    Gives how many times as fast as the reference the contestant is, the median of the rounds' ratios, and leaves it and
    what else it is told in the benchmark's extra_info; told of n pairs, the rate in millions a second as well.
    """

    def run(contestant: Timed, reference: Timed, /, calls: int, rounds: int | None = None, **info: Any) -> float:
        pair = Rounds(contestant, reference, calls)
        rounds = rounds or min(30, max(3, int(BUDGET / (pair.calls * (pair.contestant_seconds + seconds(reference))))))
        references = [pair.time_reference()]
        # Each round's teardown makes the next one ready, as pytest-benchmark takes no setup where a round has several
        # calls; those after the last round are not looked at.
        benchmark.pedantic(
            contestant,
            teardown=lambda: references.append(pair.time_reference()),
            rounds=rounds,
            iterations=pair.calls,
        )
        benchmark.extra_info.update(info)
        if not benchmark.enabled:
            return math.nan
        ratio: float = statistics.median(r / c for r, c in zip(references, benchmark.stats.stats.data, strict=False))
        benchmark.extra_info["as fast as the reference"] = ratio
        said = f"{ratio:.2f} times as fast as the reference"
        if "n" in info:
            benchmark.extra_info["rate"] = rate = info["n"] / benchmark.stats.stats.median / 1e6
            said = f"{rate:.1f} M pairs/s, {said}"
        print(f"\n{benchmark.group}: {said}", end=" ")
        return ratio

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
        rate, ratio = b.extra_info["rate"], 1 / b.extra_info["as fast as the reference"]
        write(f"  {b.extra_info['contestant']:24} {rate:10.4g} M pairs/s   {ratio:8.2f} x")

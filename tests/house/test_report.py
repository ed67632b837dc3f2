"""The figures of both READMEs come from benchmarks/report.py, which puts them in place of what stood there."""

import importlib
import json
import re
import shutil
import sys
from pathlib import Path
from typing import Any

import pytest

from tests.helpers import process

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def report():
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(ROOT / "benchmarks")
        return importlib.import_module("report")


def batch(form, n, name, seconds, as_fast, threads=2):
    info = {"form": form, "n": n, "threads": threads, "contestant": name}
    return {"extra_info": {**info, "as fast as the reference": as_fast}, "stats": {"median": seconds}}


@pytest.fixture
def data(report):
    batches = []
    for form in report.FORMS:
        batches += [
            batch(form, 10_000_000, "collide", 0.02, 1.01),
            batch(form, 10_000_000, "bytes only", 0.03, 1.25),  # in a slow minute: the ratio counts
            batch(form, 10_000_000, "NumPy", 0.2, 0.1),
            batch(form, 1, "collide", 6e-6, 1.0),
            batch(form, 1, "NumPy", 9e-6, 2.0 if form == "1d" else 0.5),
        ]
    variant = {"variant": "in_place", "n": 1_000_000, "as fast as the reference": 1.5}
    variants = [{"extra_info": {**variant, "form": form}, "stats": {}} for form in report.COLLISIONS]
    names = ("import numba", "import numba and collide", "trivial, cached", "collide, cached", "collide, compiling")
    starts = [{"extra_info": {"start": name, "seconds": s}, "stats": {}} for s, name in enumerate(names, 1)]
    searches: list[dict[str, Any]] = [
        {"extra_info": {"search": n, "space": space, "rival": "a tree", "as fast as the reference": 1 / ratio}}
        for n, space, ratio in ((100, "open", 0.5), (10_000, "open", 7.44), (10_000, "periodic", 12.3))
    ]
    others: list[dict[str, Any]] = [
        {"extra_info": {"drawn": "rows in 2D", "as fast as the reference": 0.125}},
        {"extra_info": {"resolve": "cell order", "rate": 51.2, "as fast as the reference": 1.0}},
        {"extra_info": {"step": "a gas", "rival": "an engine", "as fast as the reference": 0.125}},
        {"extra_info": {"file": "9 pairs", "rate": 5.25, "rival": "a frame", "as fast as the reference": 1.75}},
        {"extra_info": {"file": "9 pairs", "rate": 5.0, "rival": "a base", "as fast as the reference": 2.5}},
        {"extra_info": {"cluster": "one call", "as fast as the reference": 0.25}},
    ]
    others += [
        {
            "extra_info": {"way": "columns", "n": n, "by": by, "as fast as the reference": 1 / ratio},
            "stats": {"median": 4e-6 * n * ratio},
        }
        for n in (1, 1000)
        for by, ratio in (("collide", 1.0), ("prange", 0.5), ("NumPy", 3.25))
    ]
    for b in others + searches:
        info: dict[str, Any] = b["extra_info"]
        b.setdefault("stats", {})
        b["group"] = f"{info['search']} disks, {info['space']}" if "search" in info else info.get("step")
    machine = {
        "collide threads": 2,
        "numpy": "2.4",
        "numba": "0.68",
        "python_version": "3.11",
        "OMP_WAIT_POLICY": "passive",
    }
    return {
        "benchmarks": batches + variants + starts + searches + others,
        "machine_info": {**machine, "cpu": {"brand_raw": "A processor"}},
        "datetime": "2026-01-02T03:04:05",
    }


def test_what_is_saved_and_compared_is_of_one_call(tmp_path):
    """Of as many calls a round as the case says: `--benchmark-compare-fail` compares nothing else."""
    shutil.copy(ROOT / "benchmarks" / "conftest.py", tmp_path)
    (tmp_path / "test_it.py").write_text(
        "import time\n\n"
        "def test_it(race):\n"
        "    race(lambda: time.sleep(0.004), lambda: time.sleep(0.002), 5, 4, n=8, contestant='a')\n"
    )
    saved = tmp_path / "saved.json"
    command = (sys.executable, "-m", "pytest", tmp_path, "--benchmark-json", saved)
    done = process.run(*command, cwd=ROOT, env=process.environment(PYTHONPATH=ROOT / "benchmarks"))
    assert done.returncode == 0, done.stdout
    (found,) = json.loads(saved.read_text())["benchmarks"]
    stats, ratio = found["stats"], found["extra_info"]["as fast as the reference"]
    assert (stats["rounds"], stats["iterations"]) == (4, 5)
    assert 0.004 <= stats["min"] <= stats["median"] < 0.02
    assert 0.25 < ratio < 1.0
    rate, times = 8e-6 / stats["median"], 1 / ratio
    assert f"  {'a':24} {rate:10.4g} M pairs/s   {times:8.2f} x" in done.stdout


def test_rates_are_ratios_times_the_rate_of_collide(report, data):
    found = report.entries(data)
    assert found["2d", 10_000_000, 2, "collide"] == (pytest.approx(5e8), 1.0)
    assert found["2d", 10_000_000, 2, "bytes only"] == (pytest.approx(6.25e8), pytest.approx(0.8))
    assert found["2d", 1, 2, "NumPy"] == (pytest.approx(1 / 12e-6), pytest.approx(2.0))


def rows_of(lines):
    """The cells of the tables' lines, by the first of them; of several tables all."""
    found: dict[str, list[list[str]]] = {}
    for line in lines:
        if line.startswith("| "):
            first, *cells = (cell.strip() for cell in line[1:-1].split("|"))
            found.setdefault(first, []).append(cells)
    return found


def test_the_table_of_the_readme(report, data):
    lines = report.summary(data)
    rows = rows_of(lines)
    assert rows["1 pair, in the plane, columns"] == [["4.00 us", "0.25", "3.25", "0.50", ""]]
    assert rows["10,000,000 pairs, in space"] == [["20.0 ms", "500", "10.0", "", "0.80"]]
    assert rows["10,000,000 pairs, time of impact"] == [["20.0 ms", "500", "10.0", "", "0.80"]]
    assert len(rows) <= 1 + 8
    assert (
        " ".join(lines[-3:]).strip().endswith("A processor, 2 threads; Python 3.11, NumPy 2.4, Numba 0.68; 2026-01-02.")
    )


def test_all_measurements(report, data):
    lines = report.measurements(data)
    rows = rows_of(lines)
    assert rows["collide"] == [["500"] * 6]
    assert rows["NumPy"] == [["50.0"] * 6, ["10.0"] * 6]
    assert rows["the memory limit: the same bytes, nothing computed"] == [["625"] * 6, ["0.80"] * 6]
    assert rows["columns"] == [["4.00 us", "4.00 ms"], ["0.50", "0.50"], ["3.25", "3.25"]]
    assert rows["polar form"] == [["6.0 us", "12.0 us"]]
    assert rows["in place"] == [["1.50"] * 4]
    assert rows["a tree, open"] == [["0.50", "7.44"]]
    assert rows["a tree, periodic"] == [["", "12.3"]]
    assert rows["500,000 pairs of a million balls in rows in 2D, by NumPy's indexing"] == [["8.00"]]
    assert rows["cell order"] == [["51.2"]]
    assert rows["a gas, by an engine"] == [["8.00"]]
    assert rows["9 pairs"] == [["5.25", "a frame: 1.75"], ["5.00", "a base: 2.50"]]
    assert rows["one call"] == [["0.25"]]
    assert rows["the first call of resolve_2d, which is compiled"] == [["5.00 s"]]
    assert max(len(line) for line in lines if line[0:1] != "|") <= 120


def test_where_others_are_faster(report, data):
    rows = rows_of(report.losses(data))
    assert {(case, who) for case, found in rows.items() for who, _ in found if case} == {
        ("1 pair, on a line", "NumPy"),
        ("1 pair, columns", "prange"),
        ("1,000 pairs, columns", "prange"),
        ("100 disks, open", "a tree"),
    }
    assert rows["1 pair, on a line"] == [["NumPy", "0.50"]]
    assert report.losses({"benchmarks": []})[-2] == "Nowhere in this run."


@pytest.mark.parametrize(
    ("what", "row"),
    [
        ("'3d'", "10,000,000 pairs, in space"),
        ("'columns'", "columns"),
        ("a tree", "a tree, open"),
        ("in_place", "in place"),
        ("9 pairs", "9 pairs"),
        ("an engine", "a gas, by an engine"),
        ("'start'", "import numba"),
        ("'bytes only'", "the memory limit: the same bytes, nothing computed"),
    ],
)
def test_what_was_not_measured_is_left_out(report, data, what, row):
    """And nothing else."""

    def rows(data):
        return rows_of([*report.summary(data), *report.measurements(data)])

    before = rows(data)
    after = rows(data | {"benchmarks": [b for b in data["benchmarks"] if what not in str(b["extra_info"])]})
    assert row in before
    assert row not in after
    assert len(before) - len(after) <= 5


def test_nothing_measured_is_no_table(report, data):
    lines = report.measurements(data | {"benchmarks": []})
    assert not [line for line in lines if line.startswith("|")]


def test_rewriting_touches_nothing_else(report, tmp_path):
    path = tmp_path / "README.md"
    path.write_text(f"before\n{report.BEGIN}\nold\n{report.END}\nafter\n")
    report.rewrite(path, ["new", ""])
    assert path.read_text() == f"before\n{report.BEGIN}\nnew\n{report.END}\nafter\n"
    path.write_text("no markers")
    with pytest.raises(SystemExit, match="has no <!-- measured"):
        report.rewrite(path, ["new", ""])
    assert path.read_text() == "no markers"


def test_the_readmes_were_written_by_it(report):
    for name, labels in (
        ("README.md", ["10,000,000 pairs, in space"]),
        ("benchmarks/README.md", ["Taichi", "numexpr", "JAX"]),
    ):
        inside = (ROOT / name).read_text().partition(report.BEGIN)[2].partition(report.END)[0]
        for label in labels:
            assert label in inside
        for picture in re.findall(r"!\[.*\]\((.*)\)", inside):
            assert ((ROOT / name).parent / picture).exists()

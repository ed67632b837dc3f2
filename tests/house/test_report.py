"""The README's figures come from benchmarks/report.py: its text is built from data, and replaces what stood there."""

import importlib
import json
import shutil
import sys
from pathlib import Path

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
    searches = [
        {"extra_info": {"search": n, "space": space, "rival": "a tree", "as fast as the reference": 1 / ratio}}
        for n, space, ratio in ((100, "open", 0.5), (10_000, "open", 7.44), (10_000, "periodic", 12.3))
    ]
    others = [
        {"extra_info": {"drawn": "rows in 2D", "as fast as the reference": 0.125}},
        {"extra_info": {"resolve": "cell order", "rate": 51.2, "as fast as the reference": 1.0}},
        {"extra_info": {"step": "a gas", "rival": "an engine", "as fast as the reference": 0.125}},
        {"extra_info": {"file": "9 pairs", "rate": 5.25, "rival": "a frame", "as fast as the reference": 1.75}},
        {"extra_info": {"file": "9 pairs", "rate": 5.0, "rival": "a base", "as fast as the reference": 2.5}},
        {"extra_info": {"cluster": "one call", "as fast as the reference": 0.25}},
    ]
    others += [
        {
            "extra_info": {"way": "rows", "n": n, "by": by, "as fast as the reference": 1 / ratio},
            "stats": {"median": 4e-6 * n * ratio},
        }
        for n in (1, 1000)
        for by, ratio in (("collide", 1.0), ("prange", 0.5), ("NumPy", 3.25))
    ]
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


def test_a_ball_state_is_reported_as_far_as_it_was_measured(report, data):
    assert report.simulation(data) == [
        "How many times as fast as others find_contacts is, open / periodic, by the number of disks:",
        "",
        "| | 100 | 10,000 |",
        "|---|---|---|",
        "| a tree | 0.50 / - | 7.44 / 12.3 |",
        "",
        "resolve_contacts takes of a million disks, in pairs a second: 51.2 million in cell order. resolve_pairs is, "
        "for 500,000",
        "pairs of a million balls, so many times as fast as NumPy's indexing and a batch: 8.00 for rows in 2D. A step "
        "of a gas of",
        "10,000 disks takes an engine 8.00 times as long.",
        "",
    ]
    assert report.simulation({"benchmarks": []}) == []


def test_files_are_reported_as_far_as_they_were_measured(report, data):
    assert report.files(data) == [
        "`collide resolve`, all synced to disk: 9 pairs: 5.25 million pairs a second, 1.75 times as fast as a frame, "
        "2.50 times",
        "as fast as a base.",
        "Dask, from disk to disk on 2 processes of 1 thread: 0.25 times the rate of one call.",
        "",
    ]
    assert report.files({"benchmarks": []}) == []


def test_the_section(report, data):
    text = report.section(data)
    assert f"| **collide** |{' **500** |' * 6}\n" in text
    assert f"| NumPy |{' 50.0 (10.0x) |' * 6}\n" in text
    assert "in place 1.50 / 1.50 / 1.50 / 1.50 (on a line / in the plane / in space / polar form)" in text.replace(
        "\n", " "
    )
    assert "on a line 6.0 us, NumPy's expression 3.0" in text
    assert "Where it loses: 1 pair on a line: NumPy 0.50." in text
    assert "| | 1 pair | 1,000 pairs |" in text
    assert "| rows | 4.00 us: 0.50, 3.25 | 4.00 ms: 0.50, 3.25 |" in text
    assert "2026-01-02" in text
    assert max(len(line) for line in text.splitlines() if line[0:1] != "|") <= 120


def test_forms_that_were_not_measured_are_left_out(report, data):
    """As in what was saved before there were three dimensions."""
    data["benchmarks"] = [b for b in data["benchmarks"] if "3d" not in b["extra_info"].get("form", "")]
    text = report.section(data)
    assert f"| **collide** |{' **500** |' * 4}\n" in text
    assert "in place 1.50 / 1.50 / 1.50 (on a line / in the plane / polar form)" in text.replace("\n", " ")
    assert "space" not in text


def test_rewriting_touches_nothing_else(report):
    readme = f"before\n{report.BEGIN}\nold\n{report.END}\nafter\n"
    new = report.rewrite(readme, "new")
    assert new == f"before\n{report.BEGIN}\nnew\n{report.END}\nafter\n"
    with pytest.raises(SystemExit):
        report.rewrite("no markers", "new")


def test_the_readme_was_written_by_it(report):
    readme = (ROOT / "README.md").read_text()
    inside = readme.partition(report.BEGIN)[2].partition(report.END)[0]
    for label, *_ in report.CONTESTANTS.values():
        if label != report.CONTESTANTS["pymunk"][0]:
            assert f"{label}" in inside
    assert report.COMMAND in inside.replace("\n", " ")
    for name in ("sizes.svg", "bars.svg"):
        assert f"benchmarks/results/{name}" in inside
        assert (report.RESULTS / name).exists()

"""The examples, in a small version: what they print is checked, and that the picture appears."""

import json
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from collide.examples import dsmc, galperin

FOLDER = Path(dsmc.__file__).parent
CASES = json.loads((Path(__file__).parent / "data" / "published.json").read_text())


@pytest.mark.parametrize("path", sorted(FOLDER.glob("*.py")), ids=lambda path: path.stem)
def test_each_is_short(path):
    assert len(path.read_text().splitlines()) < 100


@pytest.mark.parametrize("case", [c for c in CASES if c["name"].startswith("galperin")], ids=lambda case: case["name"])
def test_galperin_counts_what_was_published(case):
    count = galperin.collisions(float(case["inputs"]["M_big"]), np.empty((1, 2)))
    assert count == case["expected"]["collisions"]


def test_galperin_keeps_the_energy():
    path = np.full((400, 2), np.nan)
    count = galperin.collisions(1e4, path)
    big, small = path[: count + 1].T
    np.testing.assert_allclose(1e4 * big**2 + small**2, 1e4, rtol=1e-13)
    assert np.isnan(path[count + 1]).all()


def test_galperin(tmp_path, capsys):
    galperin.main(["--digits", "5", "--save", str(tmp_path / "pi.png")])
    lines = capsys.readouterr().out.split("\n")
    assert [line.split()[1] for line in lines[1:6]] == ["3", "31", "314", "3,141", "31,415"]
    assert (tmp_path / "pi.png").read_bytes()[:4] == b"\x89PNG"


def test_dsmc(tmp_path, capsys):
    dsmc.main(["--disks", "50000", "--steps", "30", "--save", str(tmp_path / "speeds.png")])
    out, err = capsys.readouterr()
    moments = [float(x) for x in re.findall(r"= (\d\.\d+)", out)]
    assert moments[0] == 1.0
    assert moments[-1] == pytest.approx(2.0, abs=0.05)  # five standard errors of 50,000 speeds
    assert float(re.search(r"distribution (\S+)", out)[1]) < 0.01
    assert abs(float(re.search(r"energy (\S+)", out)[1])) < 1e-12
    assert err == ""  # no progress bar where nobody looks
    assert (tmp_path / "speeds.png").read_bytes()[:4] == b"\x89PNG"


def test_a_step_collides_each_disk_once_at_most_and_keeps_momentum():
    rng = np.random.default_rng(1)
    v = rng.normal(size=(2, 1001))
    before = v.copy()
    count = dsmc.step(v, rng)
    assert (v != before).any(axis=0).sum() <= 2 * count
    np.testing.assert_allclose(v.sum(axis=1), before.sum(axis=1), atol=1e-11)


@pytest.mark.parametrize(
    ("name", "wrong", "message"),
    [
        ("galperin", ["--digits", "9"], "--digits 9: must be 1 to 8"),
        ("dsmc", ["--steps", "0"], "--steps 0: must be at least"),
    ],
)
def test_wrong_arguments(name, wrong, message):
    command = [sys.executable, "-m", f"collide.examples.{name}", *wrong]
    run = subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)
    assert run.returncode == 2
    assert message in run.stderr

"""The examples, in a small version: what they print is checked, and that the picture appears."""

import re
import sys
from pathlib import Path

import numpy as np
import pytest

from collide.examples import cooling, dsmc, galperin, gas
from tests.helpers import process
from tests.helpers.published import cases

FOLDER = Path(dsmc.__file__).parent


@pytest.mark.parametrize("path", sorted(FOLDER.glob("*.py")), ids=lambda path: path.stem)
def test_each_is_short(path):
    assert len(path.read_text().splitlines()) < 100


@pytest.mark.parametrize("case", [case for case in cases("count") if case.id.startswith("galperin")])
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


@pytest.mark.parametrize("walls", [False, True])
def test_gas(walls, tmp_path, capsys):
    picture = tmp_path / "gas.png"
    gas.main(["--disks", "2000", "--steps", "400", "--save", str(picture), *["--walls"] * walls])
    out, err = capsys.readouterr()
    assert float(re.search(r"([\d.]+) a disk", out)[1]) > 20
    assert float(re.search(r"= (\d\.\d+)", out)[1]) == pytest.approx(2.0, abs=0.2)  # four standard errors
    assert float(re.search(r"distribution (\S+)", out)[1]) < 0.04
    assert abs(float(re.search(r"energy (\S+)", out)[1])) < 1e-12
    assert err == ""
    assert picture.read_bytes()[:4] == b"\x89PNG"


@pytest.mark.parametrize("walls", [False, True])
def test_a_gas_stays_in_its_box_and_does_not_sink_into_itself(walls):
    position, v, side = gas.start(900, 0.3, np.random.default_rng(2))
    momentum = v.sum(axis=1)
    for _ in range(300):
        gas.step(position, v, side, walls)
    if walls:
        assert (position > 0).all()
        assert (position < side).all()
    else:
        np.testing.assert_allclose(v.sum(axis=1), momentum, atol=1e-11)
    i, j = gas.collide.find_contacts(*position, gas.RADIUS, box=None if walls else (side, side))
    d = position[:, i] - position[:, j]
    if not walls:
        d -= side * np.rint(d / side)
    assert np.hypot(*d).min() > 1.4 * gas.RADIUS  # of 2


def test_cooling(tmp_path, capsys):
    picture = tmp_path / "cooling.png"
    cooling.main(["--disks", "1000", "--steps", "3000", "--restitution", "0.9", "--save", str(picture)])
    out, err = capsys.readouterr()
    t, measured, haff = (float(x) for x in out.splitlines()[-2].split())
    assert t > 50
    assert measured < 0.3
    assert measured == pytest.approx(haff, rel=0.15)
    assert float(re.search(r"law (\S+)", out)[1]) < 0.15
    assert err == ""
    assert picture.read_bytes()[:4] == b"\x89PNG"


def test_an_elastic_gas_does_not_cool():
    position, v, side = cooling.start(500, np.random.default_rng(3))
    before = cooling.temperature(v)
    for _ in range(200):
        cooling.step(position, v, side, 1.0)
    assert cooling.temperature(v) == pytest.approx(before, rel=1e-13)
    np.testing.assert_array_equal(cooling.haff(np.array([0.0, 1e9]), 1.5, 1.0), [1.5, 1.5])


@pytest.mark.parametrize(
    ("name", "wrong", "message"),
    [
        ("gas", ["--packing", "0.9"], "a --packing above 0 and up to 0.7"),
        ("cooling", ["--restitution", "1.5"], "--restitution from 0 to 1"),
        ("galperin", ["--digits", "9"], "--digits 9: must be 1 to 8"),
        ("dsmc", ["--steps", "0"], "--steps 0: must be at least"),
    ],
)
def test_wrong_arguments(name, wrong, message):
    done = process.run(sys.executable, "-m", f"collide.examples.{name}", *wrong)
    assert done.returncode == 2
    assert message in done.stderr

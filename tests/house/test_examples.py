"""The examples, in a small version: what they print is checked, and that the picture appears."""

import re
import sys
from pathlib import Path

import numpy as np
import pytest

import collide
from collide.examples import brownian, cooling, dsmc, galperin, gas, neighbours, wake
from tests.helpers import process
from tests.helpers.published import cases
from tests.helpers.sizes import sizes

FOLDER = Path(dsmc.__file__).parent


@pytest.mark.parametrize("path", sorted(FOLDER.glob("*.py")), ids=lambda path: path.stem)
def test_each_is_short(path):
    assert len(path.read_text().splitlines()) < 100


@pytest.mark.parametrize("missing", ["matplotlib", "tqdm"])
def test_what_they_need_is_said(missing):
    code = f"import runpy, sys; sys.modules[{missing!r}] = None; runpy.run_module('collide.examples.wake')"
    done = process.python(code)
    assert done.returncode == 1
    assert f"collide.examples needs {missing}: pip install matplotlib tqdm" in done.stderr


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
    dsmc.main(["--balls", "50000", "--steps", "60", "--save", str(tmp_path / "speeds.png")])
    out, err = capsys.readouterr()
    moments = [float(x) for x in re.findall(r"= (\d\.\d+)", out)]
    assert moments[0] == 1.0
    assert moments[-1] == pytest.approx(5 / 3, abs=0.03)  # five standard errors of 50,000 speeds
    assert float(re.search(r"distribution (\S+)", out)[1]) < 0.01
    assert abs(float(re.search(r"energy (\S+)", out)[1])) < 1e-12
    assert err == ""  # no progress bar where nobody looks
    assert (tmp_path / "speeds.png").read_bytes()[:4] == b"\x89PNG"


def test_a_step_collides_each_ball_once_at_most_and_keeps_momentum():
    rng = np.random.default_rng(1)
    v = rng.normal(size=(3, 1001))
    before = v.copy()
    count = dsmc.step(v, rng)
    assert 0 < (v != before).any(axis=0).sum() <= 2 * count
    np.testing.assert_allclose(v.sum(axis=1), before.sum(axis=1), atol=1e-11)


def test_hard_balls_scatter_evenly():
    """Two streams that meet: every component of the velocities after has its third of the energy."""
    v = np.zeros((3, 20_000))
    v[0] = np.repeat([1.0, -1.0], 10_000)
    before = v.copy()
    dsmc.step(v, np.random.default_rng(2))
    after = v[:, (v != before).any(axis=0)]
    assert after.shape[1] > 5000
    np.testing.assert_allclose((after**2).mean(axis=1), 1 / 3, atol=0.02)
    np.testing.assert_allclose(np.sqrt((after**2).sum(axis=0)), 1.0, rtol=1e-14)


@pytest.mark.parametrize("dimensions", [2, 3])
def test_the_distance_to_maxwells_distribution(dimensions):
    v = np.random.default_rng(3).normal(size=(dimensions, 100_000))
    assert dsmc.distance_to_maxwell(3.0 * v) < 0.006  # Kolmogorov's 1.9 / sqrt(n)
    assert dsmc.distance_to_maxwell(v / np.hypot(1.0, v)) > 0.1


@pytest.mark.parametrize("walls", [False, True])
def test_gas(walls, tmp_path, capsys):
    picture = tmp_path / "gas.png"
    gas.main(["--disks", "1000", "--steps", "5000", "--save", str(picture), *["--walls"] * walls])
    out, err = capsys.readouterr()
    assert float(re.search(r"([\d.]+) a disk", out)[1]) > 20
    assert float(re.search(r"= (\d\.\d+)", out)[1]) == pytest.approx(2.0, abs=0.3)  # four standard errors
    assert float(re.search(r"distribution (\S+)", out)[1]) < 0.06
    mean, error, law = map(float, re.search(r"pressure (\S+) \+- (\S+), .* (\S+)$", out, re.MULTILINE).groups())
    assert mean == pytest.approx(law, abs=5 * error)
    assert error < (0.06 if walls else 0.02)
    assert abs(float(re.search(r"energy (\S+)", out)[1])) < 1e-12
    assert err == ""
    assert picture.read_bytes()[:4] == b"\x89PNG"


@pytest.mark.parametrize("walls", [False, True])
@sizes(usual=(900, 300), campaign=(10_000, 10_000))
def test_a_list_that_lasts_has_every_contact(walls, size):
    """That a fresh one has, at every step; and the energy stays."""
    disks, steps = size
    position, v, side = neighbours.start(disks, 0.3, np.random.default_rng(2))
    momentum, energy = v.sum(axis=1), (v * v).sum()
    near, lists, last = neighbours.Neighbours(box=None if walls else (side, side)), 0, None
    for _ in range(steps):
        gas.step(position, v, side, near, 0.01)
        lists, last = lists + (near.pairs is not last), near.pairs
        (i, j), fresh = near.pairs, collide.find_contacts(*position, near.radius, box=near.box)
        listed = np.sort(i * disks + j)
        assert np.isin(fresh.i * disks + fresh.j, listed, assume_unique=True).all()
    assert 10 < lists < steps / 2
    assert abs((v * v).sum() / energy - 1) < 1e-12
    if walls:
        assert (position > 0).all()
        assert (position < side).all()
    else:
        np.testing.assert_allclose(v.sum(axis=1), momentum, atol=1e-9)
    d = position[:, fresh.i] - position[:, fresh.j]
    if not walls:
        d -= side * np.rint(d / side)
    assert np.hypot(*d).min() > 0.9 * 2 * near.radius


def test_cooling(tmp_path, capsys):
    picture = tmp_path / "cooling.png"
    cooling.main(["--disks", "1000", "--steps", "3000", "--restitution", "0.9", "--save", str(picture)])
    out, err = capsys.readouterr()
    t, measured, haff = (float(x) for x in out.splitlines()[-2].split())
    assert t > 25
    assert measured < 0.3
    assert measured == pytest.approx(haff, rel=0.15)
    assert float(re.search(r"law (\S+)", out)[1]) < 0.15
    assert err == ""
    assert picture.read_bytes()[:4] == b"\x89PNG"


def test_an_elastic_gas_does_not_cool():
    position, v, near = cooling.start(500, np.random.default_rng(3))
    before = cooling.temperature(v)
    for _ in range(200):
        cooling.step(position, v, near, 1.0)
    assert cooling.temperature(v) == pytest.approx(before, rel=1e-13)
    np.testing.assert_array_equal(cooling.haff(np.array([0.0, 1e9]), 1.5, 1.0), [1.5, 1.5])


def test_brownian(tmp_path, capsys):
    picture = tmp_path / "brownian.png"
    brownian.main(["--disks", "200", "--mass", "5", "--steps", "20000", "--save", str(picture)])
    out, err = capsys.readouterr()
    rows = np.array([line.split() for line in out.splitlines()[2:]], float)
    assert rows[0, 3] == pytest.approx(2.0, abs=0.05)
    assert rows[-1, 3] < 1.5
    np.testing.assert_allclose(rows[:, 1], rows[:, 2], rtol=0.5)
    assert err == ""
    assert picture.read_bytes()[:4] == b"\x89PNG"


def test_the_heavy_disk_has_room_and_the_whole_is_at_rest():
    m, radius, position, v, side = brownian.state(400, 20.0, np.random.default_rng(4))
    assert (m[0], radius[0]) == (20.0, brownian.HEAVY)
    assert collide.find_contacts(*position, radius, box=(side, side)).i.size == 0
    np.testing.assert_allclose((m * v).sum(axis=1), 0.0, atol=1e-12)
    assert (m * v * v).sum() == pytest.approx(2 * (m.size - 1), rel=1e-13)


def test_wake(tmp_path, capsys):
    picture = tmp_path / "wake.png"
    wake.main(["--disks", "400", "--save", str(picture)])
    out, err = capsys.readouterr()
    collisions, moved, disks = (int(n.replace(",", "")) for n in re.findall(r"\b[\d,]+\b", out.splitlines()[0]))
    assert collisions > disks
    assert 100 < moved < disks < 450
    along, across = map(float, re.findall(r" (-?\d+)\b", out.splitlines()[1]))
    assert abs(across) < 0.2 * along
    assert err == ""
    assert picture.read_bytes()[:4] == b"\x89PNG"


def test_the_large_disk_keeps_its_velocity_and_goes_through_no_other():
    position, v, radii, masses, side = wake.start(400, 4.0, np.random.default_rng(5))
    near, begin, counts = neighbours.Neighbours(radii), position[:, -1].copy(), []
    for _ in range(1000):
        counts.append(wake.step(position, v, masses, near, 1.0))
    assert v[:, -1].tolist() == [1.0, 0.0]
    np.testing.assert_allclose(position[:, -1] - begin, [1000 * wake.TIME_STEP, 0.0], atol=1e-12)
    assert side > 20 > begin[0] + 10
    assert sum(counts) > 100
    assert np.hypot(*(position[:, :-1] - position[:, -1:])).min() > 0.9 * (4.0 + neighbours.RADIUS)


@pytest.mark.campaign
@pytest.mark.parametrize("name", ["brownian", "cooling", "dsmc", "galperin", "gas", "wake"])
def test_each_runs_as_it_is(name, tmp_path):
    picture = tmp_path / "picture.png"
    done = process.run(sys.executable, "-m", f"collide.examples.{name}", "--save", picture)
    assert done.returncode == 0, done.stderr
    assert picture.read_bytes()[:4] == b"\x89PNG"


@pytest.mark.parametrize(
    ("name", "wrong", "message"),
    [
        ("gas", ["--packing", "0.9"], "a --packing above 0 and up to 0.7"),
        ("cooling", ["--restitution", "1.5"], "--restitution from 0 to 1"),
        ("galperin", ["--digits", "9"], "--digits 9: must be 1 to 8"),
        ("dsmc", ["--steps", "0"], "--steps 0: must be at least"),
        ("brownian", ["--mass", "0.5"], "a --mass of 1"),
        ("wake", ["--radius", "0"], "a --radius above 0"),
    ],
)
def test_wrong_arguments(name, wrong, message):
    done = process.run(sys.executable, "-m", f"collide.examples.{name}", *wrong)
    assert done.returncode == 2
    assert message in done.stderr

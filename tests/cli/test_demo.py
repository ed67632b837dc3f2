"""`collide demo`: what it prints, and how it fails."""

import re
from pathlib import Path

import pytest

from collide._cli import demo
from tests.helpers import process
from tests.helpers.tables import status


def test_demo_prints_speed_and_drift(capsys):
    demo.main(n=100_000, rounds=2)
    text = capsys.readouterr().out
    number = r"([\d.]+(?:e[-+]\d+)?)"
    for form in ("2d", "polar"):
        rate = re.search(rf"{form} +{number} million pairs/s", text)
        assert float(rate[1]) > 0.0
    for figure in ("times as fast as the NumPy expression", "of the memory limit"):
        found = re.findall(rf"{number} {figure}", text)
        assert len(found) == 2
        assert all(float(value) > 0.0 for value in found)
    drifts = re.findall(rf"{number} relative drift of total momentum, {number} of total energy", text)
    assert len(drifts) == 2
    assert all(float(value) < 1e-13 for pair in drifts for value in pair)


@pytest.mark.parametrize(
    ("error", "words"),
    [
        (MemoryError(), "out of memory"),
        (MemoryError("Unable to allocate\n76.3 MiB"), "Unable to allocate 76.3 MiB"),
        (OSError(28, "No space left"), "No space left on device"),
        (OSError("what has no number"), "what has no number"),
    ],
    ids=str,
)
def test_demo_that_fails_says_so(error, words, monkeypatch, capsys):
    def failing():
        raise error

    monkeypatch.setattr(demo, "main", failing)
    assert status("demo") == 1
    assert capsys.readouterr().err == f"collide: demo: {words}\n"


def test_demo_without_room_for_its_output():
    """Which shows when it is flushed."""
    code = (
        "from collide import __main__; from collide._cli import demo; demo.main = lambda: print(1); "
        "raise SystemExit(__main__.main(['demo']))"
    )
    with Path("/dev/full").open("w") as full:
        done = process.python(code, stdout=full)
    assert (done.returncode, done.stderr) == (1, "collide: demo: No space left on device\n")

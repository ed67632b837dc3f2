"""`collide demo`: what it prints, and how it fails."""

import os
import re
from pathlib import Path

import numpy as np
import pytest

import collide
from collide._cli import against_numpy, demo
from collide._pairs.forms import COLLISIONS
from tests.helpers import process
from tests.helpers.tables import status

ROW = r"{name} +{x} +{x} +{x} +{x} +{x} +{x} s  (compiled|loaded)\n"


def test_demo_prints_a_table(capsys):
    demo.main(n=100_000, rounds=2)
    text, progress = capsys.readouterr()
    assert progress == ""  # as this is no terminal
    for form, name in demo.NAMES.items():
        pattern = ROW.replace("{name}", name).replace("{x}", r"(\d+(?:\.\d+)?(?:e[-+]\d+)?)")
        rate, times_numpy, of_limit, momentum, energy, _ = map(float, re.search(pattern, text).groups()[:-1])
        assert min(rate, times_numpy, of_limit) > 0.0, form
        assert max(momentum, energy) < 1e-13, form
    assert f"Kernels are kept in {os.environ['NUMBA_CACHE_DIR']}" in text


@pytest.mark.parametrize("form", COLLISIONS)
def test_numpy_is_given_the_same_to_do(form):
    columns = against_numpy.random_pairs(form, 1000)
    mine, numpys = getattr(collide, f"resolve_{form}")(*columns), against_numpy.EXPRESSIONS[form](*columns)
    np.testing.assert_allclose(mine, numpys, rtol=1e-11, atol=1e-11)


def test_the_first_call_is_said_to_load_or_to_compile(monkeypatch, capsys):
    said = {}
    for was_kept in (True, False):
        for form in COLLISIONS.values():
            monkeypatch.setattr(form.kernels["dd"].cache, "was_kept", was_kept)
        demo.main(n=1000, rounds=1)
        said[was_kept] = capsys.readouterr().out
    counts = {was_kept: (text.count("s  loaded\n"), text.count("s  compiled\n")) for was_kept, text in said.items()}
    assert counts == {True: (3, 0), False: (0, 3)}


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

"""What the tests of files, of the command line and of Arrow share: a table for each form, and how a fault is said."""

import numpy as np

import collide

N = 1000
RNG = np.random.default_rng(0)


def _columns(*names):
    return {name: RNG.uniform(0.5, 2.0, N) for name in names}


LINE = _columns("m1", "m2", "v1", "v2")
PLANE = _columns("m1", "m2", "v1x", "v1y", "v2x", "v2y", "nx", "ny")
POLAR = _columns("m1", "m2", "v1", "theta1", "v2", "theta2", "phi")
FORMS = {
    "1d": (LINE, collide.resolve_1d),
    "cartesian": (PLANE, collide.resolve_2d),
    "polar": (POLAR, collide.resolve_polar),
}


def assert_one_line(capsys, *words):
    """The command line said one line, which holds these words, and nothing else."""
    captured = capsys.readouterr()
    assert captured.out == ""
    assert len(captured.err.splitlines()) == 1, captured.err
    assert captured.err.startswith("collide: ")
    for word in words:
        assert str(word) in captured.err

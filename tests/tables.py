"""Tables for the tests of files and of Arrow: columns by name, for each form."""

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

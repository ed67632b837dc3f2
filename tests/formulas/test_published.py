"""Numbers that were printed elsewhere: textbooks, theorems, other engines' tests. See data/README.md."""

import numpy as np
import pytest

import collide
from tests.helpers.naive import EPS
from tests.helpers.published import cases

pytestmark = pytest.mark.fast

# Contract 1 (8, and 10 in polar form) and the rounding of the decimal inputs to doubles.
PLANE_BOUND, POLAR_BOUND = 12, 16
# From the plane into planes of space: those across its axes, and one askew, by a third of whole numbers.
TURNS = [*(np.delete(np.eye(3), axis, 1) for axis in range(3)), np.array([[2.0, -1.0], [2.0, 2.0], [-1.0, 2.0]]) / 3]


def arguments(case):
    """For each form that the case carries: its name, the arguments in order, and the turn out of the plane."""
    i = {key: [float(x) for x in value] if isinstance(value, list) else float(value) for key, value in case.items()}
    if "n" not in i:
        yield "resolve_1d", (i["m1"], i["m2"], i["v1"], i["v2"]), None
        return
    yield "resolve_2d", (i["m1"], i["m2"], *i["v1"], *i["v2"], *i["n"]), None
    for turn in TURNS:
        yield "resolve_3d", (i["m1"], i["m2"], *turn @ i["v1"], *turn @ i["v2"], *turn @ i["n"]), turn
    yield "resolve_polar", (i["m1"], i["m2"], *i["polar1"], *i["polar2"], i["phi"]), None


def expected(case):
    v1, v2 = case["expected"]["v1"], case["expected"]["v2"]
    return [float(x) for x in ([*v1, *v2] if isinstance(v1, list) else [v1, v2])]


def check(name, turn, got, case):
    want, vectors = np.array(expected(case)), case["inputs"]
    scale = max(np.abs(want).max(), max(abs(float(x)) for v in ("v1", "v2") for x in np.ravel(vectors[v])))
    bound = POLAR_BOUND if name == "resolve_polar" else PLANE_BOUND
    got = np.array(got, float).ravel()
    if turn is not None:
        bound += 4  # of the turns there and back
        back = [turn.T @ u for u in (got[:3], got[3:])]
        np.testing.assert_allclose(
            turn @ back[0], got[:3], rtol=0, atol=bound * EPS * scale
        )  # nothing across the plane
        got = np.concatenate(back)
    np.testing.assert_allclose(got, want, rtol=0, atol=bound * EPS * scale)


def test_there_are_all_the_cases():
    assert [len(cases(kind)) for kind in ("1d", "2d")] == [19, 12]


@pytest.mark.parametrize("case", cases("1d") + cases("2d"))
def test_one_pair(case):
    e = float(case["inputs"]["e"])
    for name, args, turn in arguments(case["inputs"]):
        check(name, turn, getattr(collide.scalar, name)(*args, e), case)


@pytest.mark.parametrize("case", cases("1d") + cases("2d"))
def test_batch(case):
    e = float(case["inputs"]["e"])
    for name, args, turn in arguments(case["inputs"]):
        results = getattr(collide, name)(*(np.full(11, x) for x in args), restitution=e)
        for k in (0, 7, 10):
            check(name, turn, [u[k] for u in results], case)


@pytest.mark.parametrize("case", cases("1d") + cases("2d"))
def test_in_place(case):
    e = float(case["inputs"]["e"])
    for name, args, turn in arguments(case["inputs"]):
        columns = [np.full(11, x) for x in args]
        # The outputs take the place of as many inputs, which but for the polar form are the velocities.
        out = tuple(columns[2 : 2 + len(getattr(collide.scalar, name)(*args))])
        results = getattr(collide, name)(*columns, restitution=e, out=out)
        assert all(u is o for u, o in zip(results, out, strict=True))
        check(name, turn, [u[5] for u in out], case)

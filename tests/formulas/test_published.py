"""Numbers that were printed elsewhere: textbooks, theorems, other engines' tests. See data/README.md."""

import numpy as np
import pytest

import collide
from tests.helpers.naive import EPS
from tests.helpers.published import cases

pytestmark = pytest.mark.fast

# Contract 1 (8, and 10 in polar form) and the rounding of the decimal inputs to doubles.
PLANE_BOUND, POLAR_BOUND = 12, 16


def arguments(case):
    """For each form that the case carries: its name and the arguments in order."""
    i = {key: [float(x) for x in value] if isinstance(value, list) else float(value) for key, value in case.items()}
    if "n" not in i:
        yield "resolve_1d", (i["m1"], i["m2"], i["v1"], i["v2"])
        return
    yield "resolve_2d", (i["m1"], i["m2"], *i["v1"], *i["v2"], *i["n"])
    yield "resolve_polar", (i["m1"], i["m2"], *i["polar1"], *i["polar2"], i["phi"])


def expected(case):
    v1, v2 = case["expected"]["v1"], case["expected"]["v2"]
    return [float(x) for x in ([*v1, *v2] if isinstance(v1, list) else [v1, v2])]


def check(name, got, case):
    want = np.array(expected(case))
    scale = max(np.abs(want).max(), max(abs(float(x)) for v in ("v1", "v2") for x in np.ravel(case["inputs"][v])))
    bound = POLAR_BOUND if name == "resolve_polar" else PLANE_BOUND
    np.testing.assert_allclose(np.array(got, float).ravel(), want, rtol=0, atol=bound * EPS * scale)


def test_there_are_all_the_cases():
    assert [len(cases(kind)) for kind in ("1d", "2d")] == [19, 12]


@pytest.mark.parametrize("case", cases("1d") + cases("2d"))
def test_one_pair(case):
    e = float(case["inputs"]["e"])
    for name, args in arguments(case["inputs"]):
        check(name, getattr(collide.scalar, name)(*args, e), case)


@pytest.mark.parametrize("case", cases("1d") + cases("2d"))
def test_batch(case):
    e = float(case["inputs"]["e"])
    for name, args in arguments(case["inputs"]):
        results = getattr(collide, name)(*(np.full(11, x) for x in args), restitution=e)
        for k in (0, 7, 10):
            check(name, [u[k] for u in results], case)


@pytest.mark.parametrize("case", cases("1d") + cases("2d"))
def test_in_place(case):
    e = float(case["inputs"]["e"])
    for name, args in arguments(case["inputs"]):
        columns = [np.full(11, x) for x in args]
        # The outputs take the place of as many inputs, which in the first two forms are the velocities.
        out = tuple(columns[2 : 4 if name == "resolve_1d" else 6])
        results = getattr(collide, name)(*columns, restitution=e, out=out)
        assert all(u is o for u, o in zip(results, out, strict=True))
        check(name, [u[5] for u in out], case)

"""The report on momentum and energy, against sums in rational numbers: exact, so that only the results' errors show."""

from fractions import Fraction
from typing import Any

import numpy as np
import pytest

import collide
from collide._pairs.forms import FORM_1D, FORM_2D, FORM_3D, FORM_POLAR
from collide._tables.conservation import Conservation

N = 1003  # and a ragged end
RNG = np.random.default_rng(0)
M = RNG.uniform(0.1, 10.0, (2, N)) * 10.0 ** RNG.integers(-3, 4, (2, N))
V = RNG.normal(size=(4, N))
ANGLES = RNG.uniform(-np.pi, np.pi, (3, N))
SPEEDS = np.hypot(V[0], V[1]), np.hypot(V[2], V[3])
CASES: dict[str, tuple[Any, Any, Any]] = {
    "1d": (FORM_1D, (*M, V[0], V[1]), collide.resolve_1d),
    "2d": (FORM_2D, (*M, *V, *RNG.normal(size=(2, N))), collide.resolve_2d),
    "3d": (FORM_3D, (*M, *V, *RNG.normal(size=(5, N))), collide.resolve_3d),
    "polar": (FORM_POLAR, (*M, SPEEDS[0], ANGLES[0], SPEEDS[1], ANGLES[1], ANGLES[2]), collide.resolve_polar),
}


def exact(m1, m2, v, u):
    """The relative changes of momentum, the larger of the components, and of energy."""
    half = len(v) // 2
    masses = [m1] * half + [m2] * half

    def total(term):
        return [
            sum(term(*(Fraction(float(x)) for x in row)) for row in zip(*rows, strict=True))
            for rows in zip(masses, v, u, strict=True)
        ]

    change, size = total(lambda m, v, u: m * (u - v)), total(lambda m, v, u: m * abs(v))
    momenta = [float((change[c] + change[c + half]) / (size[c] + size[c + half])) for c in range(half)]
    energy = sum(total(lambda m, v, u: m * (u * u - v * v))) / sum(total(lambda m, v, u: m * v * v))
    return max(momenta, key=abs), float(energy)


def report(form, columns, u, e=1.0):
    kept = Conservation()
    kept.add(form, (*columns, e), u)
    return kept


@pytest.mark.parametrize("name", ["1d", "2d", "3d"])
@pytest.mark.parametrize("e", [1.0, 0.5])
def test_changes_are_those_of_exact_sums(name, e):
    form, columns, function = CASES[name]
    u = function(*columns, restitution=e)
    momentum, energy = exact(*columns[:2], columns[2 : 2 + len(u)], u)
    kept = report(form, columns, u, e)
    assert kept.momentum == pytest.approx(momentum, rel=1e-13, abs=0.0)
    assert kept.energy == pytest.approx(energy, rel=1e-13, abs=0.0)
    assert (abs(energy) < 1e-16) == (e == 1.0)
    assert abs(momentum) < 1e-16
    assert kept.n_pairs == kept.n_counted == N


def test_the_polar_form_starts_from_what_an_invalid_pair_keeps():
    form, columns, function = CASES["polar"]
    v = function(0.0, 0.0, *columns[2:], invalid="keep")
    u = function(*columns)
    momentum, energy = exact(*columns[:2], v, u)
    kept = report(form, columns, u)
    assert kept.momentum == pytest.approx(momentum, rel=1e-13, abs=0.0)
    assert kept.energy == pytest.approx(energy, rel=1e-13, abs=0.0)
    assert abs(report(form, columns, v).energy) < 1e-31  # the same velocities: nothing changed


@pytest.mark.parametrize("name", CASES)
def test_batches_add_up(name):
    form, columns, function = CASES[name]
    u = function(*columns)
    whole, parts = report(form, columns, u), Conservation()
    for part in (slice(0, 8), slice(8, 9), slice(9, 9), slice(9, N)):
        parts.add(form, (*(c[part] for c in columns), 1.0), [x[part] for x in u])
    assert parts.momentum == pytest.approx(whole.momentum, rel=1e-9, abs=1e-30)
    assert parts.energy == pytest.approx(whole.energy, rel=1e-9, abs=1e-30)
    assert parts.n_counted == whole.n_counted == N


def test_numbers_and_float32_in_place_of_columns():
    v = V[0].astype(np.float32)
    u = collide.resolve_1d(0.7, 3, v, 0.0)
    assert u.u1.dtype == np.float32
    kept = report(FORM_1D, (0.7, 3, v, 0.0), u)
    momentum, energy = exact(np.full(N, 0.7), np.full(N, 3.0), (v, np.zeros(N)), u)
    assert kept.momentum == pytest.approx(momentum, rel=1e-12, abs=0.0)
    assert kept.energy == pytest.approx(energy, rel=1e-12, abs=0.0)
    assert 1e-11 < abs(kept.momentum) < 1e-7  # float32's rounding shows


@pytest.mark.parametrize(
    ("m2", "v2"),
    [
        (np.inf, 0.0),
        (np.nan, 0.0),
        (1.0, np.inf),
        (1.0, np.nan),
        (1e300, 1e10),
        (-np.inf, 0.0),
        (-1e200, 1e60),
        (1.0, 5e153),
    ],
)
@pytest.mark.parametrize("rule", ["keep", "nan"])
def test_pairs_without_a_finite_energy_are_not_counted(m2, v2, rule):
    m, v = M[1].copy(), V[1].copy()
    m[[3, 500, N - 1]], v[[3, 500, N - 1]] = m2, v2
    u = collide.resolve_1d(M[0], m, V[0], v, invalid=rule)
    kept = report(FORM_1D, (M[0], m, V[0], v), u)
    rest = np.ones(N, bool)
    rest[[3, 500, N - 1]] = False
    others = report(FORM_1D, (M[0][rest], m[rest], V[0][rest], v[rest]), [x[rest] for x in u])
    assert (kept.n_pairs, kept.n_counted) == (N, N - 3)
    assert kept.momentum == pytest.approx(others.momentum, rel=1e-9, abs=1e-30)
    assert kept.energy == pytest.approx(others.energy, rel=1e-9, abs=1e-30)


def test_nothing_at_all():
    kept = Conservation()
    assert (kept.momentum, kept.energy, kept.n_pairs, kept.n_counted) == (0.0, 0.0, 0, 0)


def test_a_loss_shows():
    u = collide.resolve_1d(1.0, 1.0, [3.0, 1.0], [0.0, 0.0])
    kept = report(FORM_1D, (1.0, 1.0, np.array([3.0, 1.0]), 0.0), [u.u1, u.u2 * 0.5])
    assert kept.momentum == -0.5
    assert kept.energy == -0.75


def test_lanes_that_cancel_are_added_exactly():
    v1, u1 = np.array([0.0, 0.0, 0.0, 1.0]), np.array([1e16, 1.0, -1e16, 1.0])
    assert report(FORM_1D, (1.0, 1.0, v1, v1), [u1, v1]).momentum == 0.5


def test_fast_light_balls_count():
    kept = report(FORM_1D, (1e-200, 1e-200, np.array([1e160]), np.array([0.0])), [np.array([0.0]), np.array([1e160])])
    assert (kept.n_counted, kept.momentum, kept.energy) == (1, 0.0, 0.0)

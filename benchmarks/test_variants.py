"""What an option, a dtype or a layout costs: collide against itself on float64 arrays with `out` given."""

from __future__ import annotations

import numpy as np
import pytest
from cases import make_case
from contestants import itself
from contestants.itself import FUNCTIONS
from rounds import calls_a_round
from saved import COLLISIONS


def float32(case):
    columns = [c.astype(np.float32) for c in case.columns]
    out = tuple(u.astype(np.float32) for u in case.out)
    return lambda: FUNCTIONS[case.form](*columns, out=out)


def scalar_masses(case):
    return lambda: FUNCTIONS[case.form](1.0, 2.0, *case.columns[2:], out=case.out)


def allocating(case):
    return lambda: FUNCTIONS[case.form](*case.columns)


def in_place(case):
    """The velocities are resolved over and over; in polar form the results go over the speeds and directions."""
    columns = [c.copy() for c in case.columns]
    if case.form == "polar":
        return lambda: FUNCTIONS[case.form](*case.columns[:2], *columns[2:], out=tuple(columns[2:6]), invalid="keep")
    return lambda: FUNCTIONS[case.form](*columns, out=tuple(columns[2 : 2 + len(case.out)]))


def strided(case):
    """The columns of one array of pairs."""
    columns = np.stack(case.columns, 1).T
    return lambda: FUNCTIONS[case.form](*columns, out=case.out)


def approaching_only(case):
    return lambda: FUNCTIONS[case.form](*case.columns, out=case.out, approaching_only=True)


def restitution_array(case):
    e = np.full(case.n, 0.9)
    return lambda: FUNCTIONS[case.form](*case.columns, out=case.out, restitution=e)


VARIANTS = [float32, scalar_masses, allocating, in_place, strided, approaching_only, restitution_array]


@pytest.mark.parametrize("variant", VARIANTS, ids=lambda variant: variant.__name__)
@pytest.mark.parametrize("form", COLLISIONS)
@pytest.mark.parametrize("n", [10_000, 1_000_000])
def test_variant(race, benchmark, n, form, variant):
    case = make_case(form, n)
    benchmark.group = f"variants: {form}, {n:,} pairs"
    race(variant(case), itself.batch(case), calls_a_round(n), 15, form=form, n=n, variant=variant.__name__)

"""Pairs a second of collide and of what one would use instead, over the sizes of a batch."""

from __future__ import annotations

import numpy as np
import pytest
from cases import FORMS, IMPACTS, make_case
from contestants import BATCHES, entered, itself
from rounds import calls_a_round

import collide

SIZES = [1, 100, 10_000, 100_000, 1_000_000, 10_000_000]
ALL = collide.get_num_threads()


@pytest.mark.parametrize("name", BATCHES)
@pytest.mark.parametrize(
    ("form", "n", "threads"),
    [
        *((form, n, ALL) for form in FORMS for n in SIZES),
        *((form, n, 1) for form in FORMS for n in (10_000, 1_000_000) if ALL > 1),
    ],
)
def test_batch(race, benchmark, set_threads, form, n, threads, name):
    set_threads(threads)
    case = make_case(form, n)
    contestant = entered(name, BATCHES[name], case)
    if name != "bytes only":
        same_answers(contestant, case)
    benchmark.group = f"{form}, {n:,} pairs, {'1 thread' if threads == 1 else 'all threads'}"
    race(contestant, itself.batch(case), calls_a_round(n), form=form, n=n, threads=threads, contestant=name)


def same_answers(contestant, case):
    """An engine leaves separating pairs alone, and its positions move a little within a step."""
    if hasattr(contestant, "answer"):
        contestant.reset()
        contestant()
        got, tolerance = contestant.answer(), 1e-5
        want = itself.FUNCTIONS[case.form](*case.columns, approaching_only=True)
    else:
        want = np.atleast_2d(itself.FUNCTIONS[case.form](*case.columns))
        for u in case.out:
            u.fill(np.nan)
        # Times of impact by the textbook's discriminant lose half of their digits near a graze.
        got, tolerance = contestant(), 1e-6 if case.form in IMPACTS else 1e-12
    for u, w in zip(got, want, strict=True):
        np.testing.assert_allclose(u, w, rtol=tolerance, atol=20 * tolerance)

"""The loop over a batch: load lanes, call a form's step, look for what is invalid, store lanes."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from .._compile.components import each
from .._compile.elementwise import select
from .._compile.lanes import any_lane, count, doubt, fill, first, get, leading, out_of_line
from .._compile.memory import is_usual, lead, load, overlap, store
from .._compile.options import formula, rare
from .._system.memory import CACHE_LINE

# Outputs of this many bytes each and more will have left the caches before anybody reads them: they stream past.
STREAM_BYTES = 1 << 21
# Returned as the number of invalid pairs where an output overlaps an input otherwise than in place, or another output:
# nothing has been written then.
REFUSED = -1


class Step(NamedTuple):
    """What a form's step makes of the values of some pairs, lane by lane."""

    before: Any  # the results where a pair is left alone
    after: Any  # the results where it collides
    closing: Any  # the closing speed: not positive where a pair does not approach, NaN where that cannot be told
    # The quick look at what is valid: a number that is small, and numbers without a sign bit.
    size: Any
    signs: Any
    others: Any  # what the exact look needs beside the signs and the results


@formula
def loop(
    step_of: Any, obeys_rules: Any, columns: Any, outputs: Any, scalars: Any, start: int, stop: int, flags: Any
) -> tuple[int, int]:
    """Pairs start to stop of a batch. Returns how many of them are invalid, and the first that is (or -1).

    The values of that first pair join those in `scalars`: in place the columns may not have them any more.
    """
    approaching, _ = flags
    relation = overlap(columns, outputs)
    if relation < 0:
        return REFUSED, -1
    width = CACHE_LINE // outputs[0].itemsize
    head = lead(outputs, start)
    # In place the lines are in the cache already, and a streaming store would throw them out first.
    streaming = head >= 0 and outputs[0].nbytes >= STREAM_BYTES and relation == 0
    # A float32 column fits float32 outputs; a scalar, a float64, may not: then every step gets the exact check.
    beyond = _beyond(columns, outputs, scalars)
    usual = is_usual(columns)
    n_invalid, first_invalid = 0, -1
    k = start
    n = min(head if head > 0 else width, stop - start)
    while k < stop:
        values = load(columns, scalars, k, n, usual)
        step = step_of(values)
        after, break_rules = step.after, False
        if approaching:
            # Of a pair that is skipped the size does not tell whether its masses obey the rules.
            break_rules = any_lane(~obeys_rules(step, step.before, outputs))
            # Not `closing > 0`: NaN has to go on to the check.
            after = each(select, step.closing <= 0.0, step.before, after)
        if break_rules or beyond or any_lane(doubt(step.size, outputs, step.signs)):
            is_first = n_invalid == 0
            after, bad, at = _carefully(step_of, obeys_rules, columns, outputs, scalars, k, n, flags, is_first)
            if is_first:
                first_invalid = at
            n_invalid += bad
        store(outputs, k, n, after, streaming)
        k += n
        n = min(width, stop - k)
    return n_invalid, first_invalid


@rare
def _carefully(
    step_of: Any, obeys_rules: Any, columns: Any, outputs: Any, scalars: Any, k: int, n: int, flags: Any, is_first: bool
) -> Any:
    """A step again, with the exact check: the velocities to store, how many pairs are invalid, the first (or -1).

    Again and out of line: to keep the step's inputs in registers for this cost the polar form 8 % of its speed.
    """
    out_of_line()
    approaching, nan = flags
    values = load(columns, scalars, k, n, False)
    step = step_of(values)
    after = step.after
    if approaching:
        after = each(select, step.closing <= 0.0, step.before, after)
    bad = leading(~obeys_rules(step, after, outputs), n)
    n_bad, at = count(bad), -1
    if n_bad > 0:
        i = first(bad)
        at = k + i
        if is_first:
            for c in range(scalars.size):
                scalars[c] = get(values[c], i)
        after = each(select, bad, fill(step.before, math.nan) if nan else step.before, after)
    return after, n_bad, at


@rare
def _beyond(columns: Any, outputs: Any, scalars: Any) -> bool:
    """Whether a scalar, other than masses and restitution, is beyond the numbers of the outputs' dtype."""
    out_of_line()
    for c in range(2, len(columns) - 1):
        if columns[c].size == 0 and not abs(scalars[c]) <= np.finfo(outputs[0].dtype).max:
            return True
    return False

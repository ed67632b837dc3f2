"""The loop over a batch: load lanes, call a form's step, look for what is invalid, store lanes."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from .._compile.arrays import is_plain, lead, overlap, rows_of
from .._compile.components import each
from .._compile.elementwise import select
from .._compile.lanes import any_lane, count, doubt, fill, first, get, leading, out_of_line
from .._compile.memory import load, store, width_of
from .._compile.options import formula, rare
from .._compile.pieces import in_pieces
from .._compile.team import hold, let_go

# Outputs of this many bytes each and more will have left the caches before anybody reads them: they stream past.
STREAM_BYTES = 1 << 21
# What `in_pieces` returns, not the number of invalid pairs, where nothing has been written: arrays are of different
# lengths, or not what Numba takes them for, or an output overlaps an input otherwise than in place, or another output.
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
    step_of: Any,
    obeys_rules: Any,
    columns: Any,
    outputs: Any,
    scalars: Any,
    n_numbers: int,
    n: int,
    seat: int,
    approaching: bool,
    nan: bool,
) -> int:
    """The pairs of a batch. Returns how many of them are invalid.

    The values of the first of them join those in `scalars`, as in place the columns may not have them any more; behind
    them stands its number. `seat`: see `in_pieces`.
    """
    scalars[len(columns)] = math.inf
    arguments = step_of, obeys_rules, columns, outputs, scalars, n_numbers, (approaching, nan)
    found: int = in_pieces(_look, _piece, arguments, n, seat)
    return found


@formula
def _look(arguments: Any) -> Any:
    """How the arrays lie, and whether they are refused."""
    _, _, columns, outputs, scalars, n_numbers, _ = arguments
    relation = overlap(columns, outputs, n_numbers)
    # In place the lines are in the cache already, and a streaming store would throw them out first.
    may_stream = outputs[0].size * outputs[0].itemsize >= STREAM_BYTES and relation == 0
    return (rows_of(outputs), is_plain(columns), may_stream, _beyond(columns, outputs, scalars)), relation < 0


@formula
def _piece(start: int, stop: int, job: int, lie: Any, arguments: Any) -> int:
    """Pairs start to stop."""
    step_of, obeys_rules, columns, outputs, scalars, _, flags = arguments
    (rows, plain, may_stream, beyond), (approaching, _) = lie, flags
    width = width_of(outputs)
    head = lead(outputs, start, rows)
    streaming = may_stream and head >= 0
    usual = plain and rows == 0 and not approaching and not beyond
    n_invalid = 0
    k = start
    n = min(head if head > 0 else width, stop - start)
    while k < stop:
        if usual and n == width:
            end = stop - (stop - k) % width
            n_invalid += _usual_steps(step_of, obeys_rules, columns, outputs, scalars, k, end, flags, streaming, job)
            k = end
        else:
            values = load(columns, scalars, k, n, plain, outputs)
            step = step_of(values)
            after, break_rules = step.after, False
            if approaching:
                # Of a pair that is skipped the size does not tell whether its masses obey the rules.
                break_rules = any_lane(~obeys_rules(step, step.before, outputs))
                # Not `closing > 0`: NaN has to go on to the check.
                after = each(select, step.closing <= 0.0, step.before, after)
            if break_rules or beyond or any_lane(doubt(step.size, outputs, step.signs)):
                after, n_bad = _carefully(step_of, obeys_rules, columns, outputs, scalars, k, n, flags, job)
                n_invalid += n_bad
            store(outputs, k, n, after, streaming, rows)
            k += n
        n = min(width, stop - k)
    return n_invalid


@formula
def _usual_steps(
    step_of: Any,
    obeys_rules: Any,
    columns: Any,
    outputs: Any,
    scalars: Any,
    k: int,
    end: int,
    flags: Any,
    streaming: bool,
    job: int,
) -> int:
    """Whole steps over columns without gaps, which nearly all are: what the loop asks at each otherwise is a seventh of
    its time in the caches.
    """
    width, n_invalid = width_of(outputs), 0
    while k < end:
        step = step_of(load(columns, scalars, k, width, True, outputs))
        after = step.after
        if any_lane(doubt(step.size, outputs, step.signs)):
            after, n_bad = _carefully(step_of, obeys_rules, columns, outputs, scalars, k, width, flags, job)
            n_invalid += n_bad
        store(outputs, k, width, after, streaming, 0)
        k += width
    return n_invalid


@rare
def _carefully(
    step_of: Any, obeys_rules: Any, columns: Any, outputs: Any, scalars: Any, k: int, n: int, flags: Any, job: int
) -> Any:
    """A step again, with the exact check: the velocities to store, and how many pairs are invalid.

    Again and out of line: to keep the step's inputs in registers for this cost the polar form 8 % of its speed.
    """
    out_of_line()
    approaching, nan = flags
    values = load(columns, scalars, k, n, False, outputs)
    step = step_of(values)
    after = step.after
    if approaching:
        after = each(select, step.closing <= 0.0, step.before, after)
    bad = leading(~obeys_rules(step, after, outputs), n)
    n_bad = count(bad)
    if n_bad > 0:
        i = first(bad)
        if k + i < scalars[len(values)]:
            hold(job)
            if k + i < scalars[len(values)]:
                for c in range(len(values)):
                    scalars[c] = get(values[c], i)  # of a number itself: other threads may be reading it
                scalars[len(values)] = k + i
            let_go(job)
        after = each(select, bad, fill(step.before, math.nan) if nan else step.before, after)
    return after, n_bad


@formula
def _beyond(columns: Any, outputs: Any, scalars: Any) -> bool:
    """Whether a scalar, other than masses and restitution, is beyond the numbers of the outputs' dtype.

    A float32 column fits float32 outputs; a scalar, a float64, may not: then every step gets the exact check.
    """
    for c in range(2, len(columns) - 1):
        if columns[c].size == 0 and not abs(scalars[c]) <= np.finfo(outputs[0].dtype).max:
            return True
    return False

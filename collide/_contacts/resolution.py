"""Pairs resolved in the order of their list: what the functions for contacts and for drawn pairs have in common."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from .._pairs.arguments import share_memory
from .._pairs.forms import Form
from .._system import threads
from .._typing import Array
from ..errors import InvalidPairError, reason
from . import state
from .in_order import CHECK, DISJOINT

Found = tuple[int, int, int]  # how many pairs have been resolved, how many are invalid, and the first that is

_BALLS_A_PAIR = 8  # where there are more, to have a mark for each costs as much as a second thread gains


def resolve(
    form: Form,
    given: tuple[Any, Any],
    n_balls: int,
    inputs: tuple[Array, ...],
    v: Mapping[str, Array],
    impulse: Any,
    invalid: Any,
    run: Callable[[list[Array], list[Array], Array, Array], Found],
) -> int:
    """How many of the pairs `run` has resolved, in place; or the error that tells of the invalid ones.

    given, inputs: i and j as the caller gave them; i, j and whatever else is read
    v, impulse: what is written, the velocities by name
    run: is called with inputs that share no memory with what is written, velocities and impulses as kernels take them,
        and an array for the values of the first invalid pair
    """
    outputs = dict(v)
    if impulse is not None:
        outputs["impulse"] = state.impulses(impulse, "i", inputs[0].size)
    check_apart(outputs)
    i, j = inputs[:2]
    if not CHECK.compiled(i, j, n_balls):
        state.raise_for_pairs(np.asarray(given[0]), np.asarray(given[1]), n_balls)

    apart = [a.copy() if any(share_memory(a, u) for u in outputs.values()) else a for a in inputs]
    targets = [u if _is_usual(u) else u.copy() for u in outputs.values()]
    witness = np.empty(len(form.columns))
    impulses = targets[-1] if impulse is not None else np.empty(0)
    n_resolved, n_invalid, first = run(apart, targets[: len(v)], impulses, witness)
    for u, target in zip(outputs.values(), targets, strict=True):
        if u is not target:
            u[...] = target
    if n_invalid and invalid == "raise":
        pair = dict(zip(form.columns, witness.tolist(), strict=True))
        i, j = apart[:2]
        raise InvalidPairError((first,), n_invalid, f"balls {i[first]} and {j[first]}, as 1 and 2: {reason(pair)}")
    return int(n_resolved)


def check_apart(outputs: Mapping[str, Array]) -> None:
    """Whether what is written shares memory."""
    for (name, u), (other, w) in itertools.combinations(outputs.items(), 2):
        if share_memory(u, w):
            raise ValueError(f"{name} and {other} share memory")


def _is_usual(u: Array) -> bool:
    """Whether kernels may write to it: no element lies askew in memory, or where another does."""
    return u.flags.aligned and (u.size < 2 or abs(u.strides[0]) >= u.itemsize)


def in_any_order(task: Callable[..., Found], i: Array, j: Array, n_balls: int) -> Found:
    """task(start, stop) over all pairs, on all threads if no ball stands in two of them and they are worth it.

    To tell so takes a tenth of the time of one thread, and less where a ball comes again early. On two threads half a
    million pairs took 6.7 ms of 10, and 50,000 as long as on one.
    """
    n = i.size
    if not threads.is_worth_it(n) or n_balls > _BALLS_A_PAIR * n:
        return task(0, n)
    if not DISJOINT.compiled(i, j, np.zeros(n_balls, np.uint8)):
        return task(0, n)
    shares = threads.run(task, n)
    firsts = [first for _, _, first in shares if first >= 0]
    if firsts:
        task(firsts[0], firsts[0] + 1)  # once more: it has been left as it was, and its values have to be told
    return sum(share[0] for share in shares), sum(share[1] for share in shares), firsts[0] if firsts else -1

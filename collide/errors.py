"""The error for pairs that have no answer, and the rules in words."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any


class InvalidPairError(ValueError):
    """Some pairs of a batch break the rules; all others have been resolved.

    Their results are in `out`, and those of a ball state in place; without `out` they are lost with the call. Where
    that would matter, pass `out`, or ask for ``invalid="keep"`` or ``invalid="nan"``, which raise nothing.

    Parameters
    ----------
    index, count, reason : tuple of int, int, str
        The attributes.

    Attributes
    ----------
    index : tuple of int
        The first invalid pair, in the broadcast shape of the batch, without the last axis where that is of vectors; of
        numbers it is (). In a list of contacts or pairs it is the place there, in a table the row.
    count : int
        How many pairs are invalid; in a Dask array, how many of the first chunk that has any.
    reason : str
        What is wrong with the first: the argument, its value and the rule.

    See Also
    --------
    resolve_2d : What its `invalid` says holds for all functions of the kind.

    Examples
    --------
    >>> out = np.empty(2), np.empty(2)
    >>> try:
    ...     collide.resolve_1d(0.5, 3.5, [4.0, np.nan], 0.0, out=out)
    ... except collide.InvalidPairError as error:
    ...     print(error.index, error.count, error.reason)
    (1,) 1 v1 = nan: must be finite
    >>> out[1]
    array([1., 0.])
    """

    def __init__(self, index: tuple[int, ...], count: int, reason: str) -> None:
        self.index, self.count, self.reason = index, count, reason
        place = f"pair {index[0] if len(index) == 1 else index}: " if index else ""
        others = f" ({count} invalid pairs in all)" if count > 1 else ""
        super().__init__(f"{place}{reason}{others}")

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (self.index, self.count, self.reason)


def reason(pair: Mapping[str, float]) -> str:
    """The first rule that an invalid pair breaks, in words; `pair` has its values by column.

    The kernels decide which pairs are invalid; test_invalid.py holds that the two agree.
    """
    for name in ("m1", "m2"):
        if not pair.get(name, 1.0) >= 0.0:
            return f"{name} = {pair[name]}: a mass must be >= 0 (0 is a test particle, inf an immovable ball)"
    if pair.get("m1") == pair.get("m2") == 0.0:
        return "m1 = m2 = 0: one mass of a pair must be above 0"
    not_negative = ("restitution", "distance")
    for name, value in pair.items():
        if name not in ("m1", "m2", *not_negative) and not math.isfinite(value):
            return f"{name} = {value}: must be finite"
    for name in not_negative:
        if not 0.0 <= pair.get(name, 0.0) < math.inf:
            return f"{name} = {pair[name]}: must be finite and >= 0"
    normal = [name for name in ("nx", "ny", "nz") if name in pair]
    if normal and not any(pair[name] for name in normal):
        return f"{' = '.join(normal)} = 0: the normal must have a length"
    if pair.get("m1") == pair.get("m2") == math.inf:
        return "m1 = m2 = inf: two immovable balls cannot collide"
    if "distance" in pair:
        return "the balls meet, but at a time that is too large for the dtype of the result"
    return "the result of the collision, or a step on the way to it, is too large for the dtype of the result"

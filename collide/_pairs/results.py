"""Whether results can go to the arrays of `out` as they are, and how they get there otherwise."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from .._typing import Array


def address(array: Array) -> int:
    return array.__array_interface__["data"][0]  # type: ignore[no-any-return]


def clash(columns: Sequence[Array], outputs: Sequence[Array]) -> bool:
    """Whether a kernel might refuse these outputs: what `overlap` in _compile/arrays.py asks.

    Asked here of arrays of any dimensions, as a whole: a kernel that sees them block by block might refuse one when it
    has written others.
    """
    return any(_meet(a, u) for i, u in enumerate(outputs) for a in (*columns, *outputs[:i]))


def _meet(a: Array, u: Array) -> bool:
    """Whether two arrays may share memory in any way but element upon element, which is in place."""
    if a is u or not np.may_share_memory(a, u):
        return False
    if a.dtype != u.dtype or a.shape != u.shape or a.strides != u.strides:
        return True
    between = address(u) - address(a)
    if between and u.ndim == 1 and (step := abs(u.strides[0])):
        return not u.itemsize <= between % step <= step - u.itemsize  # or they interleave, as columns of rows do
    return bool(between)


def copy_to(outputs: Sequence[Array], targets: Sequence[Array]) -> None:
    for u, target in zip(outputs, targets, strict=True):
        u[...] = target

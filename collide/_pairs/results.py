"""Where results go: new arrays, or those of `out`."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from .._compile import kept_memory
from .._typing import Array

_empty = np.empty  # looked up at every call
LARGE = kept_memory.LARGE // 8  # as float64


def fresh(count: int, shape: tuple[int, ...], dtype: np.dtype[Any], inputs: Sequence[Array | None]) -> list[Array]:
    """New outputs. Large ones have the offset from a cache line that the first input of this dtype has.

    Streaming stores need outputs that agree, and a step's loads are then whole lines as well: inputs at an odd 16
    bytes, NumPy's usual, under outputs on a line cost a sixth of the speed, a quarter in polar form. And they lie at
    different places of a page, as columns at the same place would throw each other out of the nearest cache: to NumPy's
    large arrays, the usual inputs, that happens.
    """
    if dtype.itemsize * (shape[0] if len(shape) == 1 else math.prod(shape)) < kept_memory.LARGE:
        return [_empty(shape, dtype) for _ in range(count)]
    like = next((address(a) for a in inputs if a is not None and a.size and a.dtype == dtype), 0)
    return kept_memory.empty(count, shape, dtype, like // dtype.itemsize * dtype.itemsize)


def address(array: Array) -> int:
    return array.__array_interface__["data"][0]  # type: ignore[no-any-return]


def clash(columns: Sequence[Array], outputs: Sequence[Array]) -> bool:
    """Whether a kernel might refuse these outputs: what `overlap` in _compile/arrays.py asks, of any dimensions."""
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

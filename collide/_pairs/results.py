"""Where results go: new arrays, and those of `out` that a kernel can write to as they lie."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from .._system.memory import CACHE_LINE
from .._typing import Array
from .loop import STREAM_BYTES

_ndarray, _empty = np.ndarray, np.empty  # looked up at every call
# NumPy's flags C_CONTIGUOUS and WRITEABLE.
_READY = 0x0001 | 0x0400


def fresh(count: int, shape: tuple[int, ...], dtype: np.dtype[Any], inputs: Sequence[Array | None]) -> list[Array]:
    """New outputs. Large ones get the offset from a cache line that the first input of this dtype has.

    Streaming stores need outputs that agree, and a step's loads are then whole lines as well: inputs at an odd 16
    bytes, NumPy's usual, under outputs on a line cost a sixth of the speed, a quarter in polar form.
    """
    item = dtype.itemsize
    size = item * (shape[0] if len(shape) == 1 else math.prod(shape))
    if size < STREAM_BYTES:
        return [_empty(shape, dtype) for _ in range(count)]
    like = next((address(a) for a in inputs if a is not None and a.size and a.dtype == dtype), 0)
    outputs = []
    for _ in range(count):
        raw = np.empty(size + CACHE_LINE, np.uint8)
        start = (like - address(raw)) % CACHE_LINE // item * item
        outputs.append(raw[start : start + size].view(dtype).reshape(shape))
    return outputs


def address(array: Array) -> int:
    return array.__array_interface__["data"][0]  # type: ignore[no-any-return]


def all_ready(out: Sequence[Any], shape: tuple[int, ...], dtype: Any) -> bool:
    """Whether a kernel can write its results to these as they lie."""
    for u in out:  # a loop: the generator of all() takes a third longer
        if type(u) is not _ndarray or u.dtype is not dtype or u.shape != shape or u.flags.num & _READY != _READY:
            return False
    return True


def copy_to(outputs: Sequence[Array], targets: Sequence[Array]) -> None:
    for u, target in zip(outputs, targets, strict=True):
        u[...] = target

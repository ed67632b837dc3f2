"""Arrays that a kernel cannot read or write as they lie, which pass through its reach block by block, in the cache."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np

from .._typing import Array

_BLOCK = 1 << 13  # elements that are copied, and converted, at a time

Index = tuple[Any, ...]  # of a part of an array


def flat(array: Array, dtype: np.dtype[Any]) -> Array | None:
    """The array as a kernel reads it, native and aligned numbers at equal steps. None where it is not that.

    Numba must not be left to find out: it takes what is byte-swapped or misaligned for whatever it has seen of either,
    so that after an array of the one kind it refuses those of the other.
    """
    if array.dtype != dtype or not array.flags.aligned:
        return None
    try:
        return np.asarray(array).reshape(-1, copy=False)
    except ValueError:
        return None


def in_a_line(array: Array, shape: tuple[int, ...]) -> Array:
    """An array of this shape in one dimension; a ValueError where it has another, or cannot be seen so."""
    if array.shape != shape:
        raise ValueError
    return array.reshape(-1, copy=False)


def flat_copy(array: Array, dtype: np.dtype[Any]) -> Array:
    with np.errstate(invalid="ignore"):  # a signalling NaN on its way to the check
        return np.array(array, dtype).reshape(-1)


class Passage:
    """A block's length of memory through which an array of any dtype, byte order and strides passes."""

    def __init__(self, array: Array, dtype: np.dtype[Any]) -> None:
        self._array = array
        self.memory = np.empty(_BLOCK, dtype)

    def filled(self, where: Index) -> Array:
        part = self._array[where]
        with np.errstate(invalid="ignore"):
            np.copyto(self.memory[: part.size].reshape(part.shape), part, casting="unsafe")
        return self.memory[: part.size]

    def empty(self, where: Index) -> None:
        part = self._array[where]
        part[...] = self.memory[: part.size].reshape(part.shape)


def blocks(shape: tuple[int, ...], start: int, stop: int) -> Iterator[tuple[int, int, Index]]:
    """Cuts the elements start to stop, in C order, into boxes of at most _BLOCK: their range and their index."""
    sizes = [math.prod(shape[axis + 1 :]) for axis in range(len(shape))]
    while start < stop:
        # Along the first axis on which a whole layer begins here and fits.
        fits = (k for k, size in enumerate(sizes) if start % size == 0 and size <= min(_BLOCK, stop - start))
        axis = next(fits)
        at = np.unravel_index(start, shape)
        layers = min(shape[axis] - int(at[axis]), min(_BLOCK, stop - start) // sizes[axis])
        end = start + layers * sizes[axis]
        yield start, end, (*at[:axis], slice(at[axis], at[axis] + layers))
        start = end

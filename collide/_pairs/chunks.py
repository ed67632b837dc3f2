"""A batch over Dask arrays: a task a chunk, each on its own thread only."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from typing import Any

import dask
import dask.array as da
import numpy as np

from .._system import threads
from ..errors import InvalidPairError
from . import arguments, execution
from .forms import FORMS

_MOST_DIMENSIONS = 64  # of NumPy's arrays; the results of a chunk lie in one array, which has one more


def lazily(form: str, inputs: Sequence[Any], approaching_only: Any, invalid: Any) -> list[Any]:
    """The outputs: slices of one array of them all, each of whose chunks is a task."""
    columns, outputs = FORMS[form].columns, FORMS[form].outputs
    values = dict(zip(columns, inputs, strict=True))
    arrays = {name: array for name, value in values.items() if (array := as_dask(name, value)) is not None}
    for name, array in arrays.items():
        if any(math.isnan(size) for sizes in array.chunks for size in sizes):
            raise ValueError(f"{name} has chunks of unknown sizes: call its compute_chunk_sizes() first")
    shape = arguments.broadcast_shape(list(arrays), list(arrays.values()))  # or an error that names them
    if len(shape) >= _MOST_DIMENSIONS:
        raise ValueError(f"arguments of {len(shape)} dimensions: must have fewer than {_MOST_DIMENSIONS}")
    none = {**values, **{name: np.empty(0, array.dtype) for name, array in arrays.items()}}
    like, _ = execution.attempt(FORMS[form], tuple(none.values()), approaching_only, invalid, None)
    dtype = like[0].dtype
    if not arrays:  # one number becomes an array: a NumPy scalar, if there is one, as that counts for the dtype
        name = next((name for name, value in values.items() if type(value) not in arguments.WEAK), columns[0])
        arrays = {name: da.asarray(arguments.as_array(name, values[name]))}
    values.update(zip(arrays, da.broadcast_arrays(*arrays.values()), strict=True))
    chunks = values[next(iter(arrays))].chunks
    stacked = da.map_blocks(
        _resolve_chunk,
        *values.values(),
        form=form,  # by its name: kernels stay where they have been compiled
        dtypes=[arrays[name].dtype.str if name in arrays else None for name in columns],
        result=dtype.str,
        options=(approaching_only, invalid),
        starts=[_starts(sizes) for sizes in chunks],
        new_axis=0,
        chunks=((len(outputs),), *chunks),
        dtype=dtype,
        meta=np.empty((0,) * (len(chunks) + 1), dtype),
    )
    return [stacked[k] for k in range(len(outputs))]


def as_dask(name: str, value: Any) -> Any:
    """A Dask array, or None for a number."""
    if not dask.is_dask_collection(value):
        value = arguments.as_array(name, value)
        return da.asarray(value) if value.ndim else None
    array = da.asarray(value)
    arguments.as_array(name, array._meta)
    return array


def _starts(sizes: tuple[int, ...]) -> Sequence[int]:
    """Where the chunks of an axis begin: in few bytes where they are even, as each task has it."""
    even = len(set(sizes[:-1])) <= 1 and 0 < sizes[0] >= sizes[-1]
    return range(0, sum(sizes), sizes[0]) if even else [0, *itertools.accumulate(sizes)]


def _resolve_chunk(
    *blocks: Any,
    form: str,
    dtypes: list[str | None],
    result: str,
    options: tuple[Any, Any],
    starts: list[Sequence[int]],
    block_id: tuple[int, ...],
) -> Any:
    """The outputs of a chunk, as one array."""
    # A block may have another dtype than its array says.
    inputs = tuple(b if kind is None else np.asarray(b, kind) for b, kind in zip(blocks, dtypes, strict=True))
    shape = arguments.broadcast_shape(FORMS[form].columns, [*map(np.asarray, inputs)])
    stacked = np.empty((len(FORMS[form].outputs), *shape), result)
    with threads.alone():
        _, error = execution.attempt(FORMS[form], inputs, *options, tuple(stacked[k, ...] for k in range(len(stacked))))
    if error and options[1] == "raise":
        index = (start[b] + i for start, b, i in zip(starts, block_id[1:], error.index, strict=True))
        raise InvalidPairError(tuple(index), error.count, error.reason)
    return stacked

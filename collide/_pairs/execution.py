"""A call: arguments as a kernel takes them, as they lie or block by block, on as many threads as they are worth.

Every batch function ends in `attempt`. It looks for the usual case first, arrays that a kernel takes as they are, and
leaves all others, and all errors, to the general way.
"""

from __future__ import annotations

import functools
import math
import reprlib
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from .._system import threads
from .._typing import Array
from ..errors import InvalidPairError, reason
from .arguments import WEAK, as_array, broadcast_shape, checked_outputs, gives_nan, share_memory
from .blocks import Passage, blocks, flat, flat_copy
from .forms import Form
from .loop import REFUSED
from .results import address, all_ready, copy_to, fresh

Flags = tuple[bool, bool]  # approaching_only, and whether an invalid pair gets NaN

_ndarray, _float64, _empty = np.ndarray, np.float64, np.empty  # looked up nine times a call
_FLOAT64, _FLOAT32 = np.dtype(np.float64), np.dtype(np.float32)
_NOTHING = {dtype: np.empty(0, dtype) for dtype in (_FLOAT64, _FLOAT32)}
_BOOLS = bool, np.bool_
# Up to so many pairs a copy is cheaper than to find out about strides, and about what overlaps what.
_SMALL = 1 << 12


class Tally(NamedTuple):
    """The invalid pairs of a share: how many, the first, and that one's values."""

    n_invalid: int
    first: int
    witness: Array

    def plus(self, later: Tally, offset: int = 0) -> Tally:
        """With those of a share that begins at the offset."""
        if self.n_invalid or not later.n_invalid:
            return self._replace(n_invalid=self.n_invalid + later.n_invalid)
        return later._replace(first=offset + later.first)


# The inputs of a call: an array a column, which is empty where a number stands for it; those numbers; the number of
# pairs; their shape; the dtype of the result. It is no named tuple, as to make one takes a twentieth of a call.
Batch = tuple[list[Array], Array, int, tuple[int, ...], np.dtype[Any]]


def call(form: Form, inputs: tuple[Any, ...], approaching_only: Any, invalid: Any, out: Any) -> Sequence[Any]:
    """The outputs of a call, scalars where all inputs are scalars."""
    outputs, error = attempt(form, inputs, approaching_only, invalid, out)
    if error and invalid == "raise":
        raise error
    return outputs


def attempt(
    form: Form, inputs: tuple[Any, ...], approaching_only: Any, invalid: Any, out: Any
) -> tuple[Sequence[Any], InvalidPairError | None]:
    """The outputs of a call, and the error that tells of its invalid pairs, if there are any."""
    if approaching_only is not False and not isinstance(approaching_only, _BOOLS):
        raise TypeError(f"approaching_only = {reprlib.repr(approaching_only)}: must be True or False")
    options = bool(approaching_only), gives_nan(invalid, form.invalid)
    batch = _as_given(inputs)
    done = _usual(form, batch, out, options) if batch else None
    outputs, tally = done or _general(form, inputs, out, options)
    if tally is None:
        return outputs, None
    index = tuple(int(i) for i in np.unravel_index(tally.first, np.shape(outputs[0])))
    pair = dict(zip(form.columns, tally.witness.tolist(), strict=True))
    return outputs, InvalidPairError(index, tally.n_invalid, reason(pair))


def _as_given(inputs: tuple[Any, ...]) -> Batch | None:
    """Numbers, and arrays of one shape and dtype that lie as a kernel takes them; None if there is anything else.

    A third of the time that the general way takes goes into this. Strides are in the way of a large batch only: of
    small arrays copies are made.
    """
    n, shape, dtype = 1, (), _FLOAT64
    columns, scalars, numbers = [*inputs], _empty(len(inputs)), []
    for i, value in enumerate(inputs):
        kind = type(value)
        if kind is _ndarray:
            if not shape:
                n, shape, dtype = value.size, value.shape, value.dtype
                if not (n and shape and dtype in _NOTHING):
                    return None
            # The byte order too: Numba takes a byte-swapped array for a native one that it has seen.
            if value.dtype is not dtype or value.shape != shape:
                return None
            if not value.flags.c_contiguous:
                if n > _SMALL:
                    return None
                columns[i] = value.copy()
        elif kind is float or kind is int or kind is _float64:
            try:
                scalars[i] = value
            except OverflowError:
                return None
            numbers.append(i)
        else:
            return None
    if dtype is not _FLOAT64 and any(type(inputs[i]) is _float64 for i in numbers):
        return None  # a NumPy scalar counts for the result's dtype, Python's numbers do not
    for i in numbers:
        columns[i] = _NOTHING[dtype]
    if len(shape) > 1:
        columns = [c.reshape(-1) for c in columns]  # numbers, which are empty arrays, too
    return columns, scalars, n, shape, dtype


def _usual(form: Form, batch: Batch, out: Any, options: Flags) -> tuple[Sequence[Any], Tally | None] | None:
    """The outputs of inputs as they were given; None where `out` asks for the general way, or is at fault."""
    columns, scalars, n, shape, dtype = batch
    kernel = form.kernels[dtype].compiled
    if out is None:
        outputs = fresh(len(form.outputs), shape or (1,), dtype, columns)
        tally = _run(kernel, columns, _lines(outputs, shape), scalars, n, options)
        return outputs if shape else [u[0] for u in outputs], tally
    if not shape or not isinstance(out, tuple) or len(out) != len(form.outputs):
        return None
    if all_ready(out, shape, dtype):
        # Whether outputs overlap inputs is left to the kernel, which tells it sooner than NumPy and refuses.
        tally = _run(kernel, columns, _lines(out, shape), scalars, n, options)
        if tally is None or tally.n_invalid != REFUSED:
            return [*out], tally
    if n > _SMALL:
        return None
    outputs = checked_outputs(form.outputs, out, shape, dtype)
    targets = fresh(len(out), shape, dtype, columns)
    tally = _run(kernel, columns, _lines(targets, shape), scalars, n, options)
    copy_to(outputs, targets)
    return outputs, tally


def _lines(arrays: Sequence[Array], shape: tuple[int, ...]) -> Sequence[Array]:
    """Contiguous arrays of this shape, each in one dimension."""
    return arrays if len(shape) < 2 else [a.reshape(-1) for a in arrays]


def _run(
    kernel: Callable[..., tuple[int, int]],
    columns: Sequence[Array],
    outputs: Sequence[Array],
    scalars: Array,
    n: int,
    options: Flags,
) -> Tally | None:
    """The pairs of contiguous columns, on as many threads as they are worth; None where all are valid."""
    if not threads.is_shared(n):
        n_invalid, first = kernel(*columns, *outputs, scalars, 0, n, *options)
        return Tally(n_invalid, first, scalars) if n_invalid else None

    def share(start: int, stop: int) -> Tally:
        own = scalars.copy()
        n_invalid, first = kernel(*columns, *outputs, own, start, stop, *options)
        return Tally(n_invalid, first, own)

    return _in_all(threads.run(share, n))


def _in_all(tallies: list[Tally]) -> Tally | None:
    if tallies[0].n_invalid == REFUSED:  # as all do then: each has looked at the whole arrays
        return tallies[0]
    tally = functools.reduce(Tally.plus, tallies)
    return tally if tally.n_invalid else None


def _general(form: Form, inputs: tuple[Any, ...], out: Any, options: Flags) -> tuple[Sequence[Any], Tally | None]:
    """Everything else: other dtypes and layouts, more dimensions, outputs over inputs; and whatever is an error."""
    batch = _as_arrays(form.columns, inputs)
    columns, _, n, shape, dtype = batch
    if out is None:
        targets = outputs = fresh(len(form.outputs), shape, dtype, columns)
    else:
        outputs = checked_outputs(form.outputs, out, shape, dtype)
        apart = n > _SMALL and not _clash(columns, outputs)
        targets = outputs if apart else fresh(len(outputs), shape, dtype, columns)
    tally = _run_converted(form.kernels[dtype].compiled, batch, targets, options)
    assert tally is None or tally.n_invalid != REFUSED  # nothing is left that a kernel refuses
    if targets is not outputs:
        copy_to(outputs, targets)
    return outputs if out is not None or shape else [u[()] for u in outputs], tally


def _as_arrays(names: Sequence[str], inputs: Sequence[Any]) -> Batch:
    """Whatever else NumPy makes arrays of. Size-1 arrays become numbers, so that none becomes a full-length array."""
    arrays = [as_array(name, value) for name, value in zip(names, inputs, strict=True)]
    shape = broadcast_shape(names, arrays)
    kinds = [WEAK.get(type(value), a.dtype) for value, a in zip(inputs, arrays, strict=True)]
    dtype = _FLOAT32 if np.result_type(*kinds) in (_FLOAT32, np.float16) else _FLOAT64
    scalars = np.array([float(a.item()) if a.size == 1 else math.nan for a in arrays])
    columns = [_NOTHING[dtype] if a.size == 1 else a if a.shape == shape else np.broadcast_to(a, shape) for a in arrays]
    return columns, scalars, math.prod(shape), shape, dtype


def _clash(columns: Sequence[Array], outputs: Sequence[Array]) -> bool:
    """Whether an output shares memory with an input in any way but element upon element, which is in place."""
    for a in columns:
        for u in outputs:
            if a is not u and share_memory(a, u):
                same = a.dtype == u.dtype and a.shape == u.shape and a.strides == u.strides
                if not same or address(a) != address(u):
                    return True
    return False


def _run_converted(
    kernel: Callable[..., tuple[int, int]], batch: Batch, targets: Sequence[Array], options: Flags
) -> Tally | None:
    """What a kernel cannot read or write as it lies passes through blocks, in the cache; a small batch is copied."""
    given, scalars, n, shape, dtype = batch
    columns = [flat(a, dtype) for a in given]
    results = [flat(u, dtype) for u in targets]
    if n <= _SMALL:  # what is not flat is an input: the targets are fresh
        columns = [flat_copy(a, dtype) if c is None else c for a, c in zip(given, columns, strict=True)]
    flat_columns = [c for c in columns if c is not None]
    flat_results = [r for r in results if r is not None]
    if len(flat_columns) == len(columns) and len(flat_results) == len(results):
        return _run(kernel, flat_columns, flat_results, scalars, n, options)

    def by_blocks(start: int, stop: int) -> Tally:
        total = Tally(0, -1, scalars)
        sources = [Passage(a, dtype) if c is None else c for a, c in zip(given, columns, strict=True)]
        sinks = [Passage(u, dtype) if r is None else r for u, r in zip(targets, results, strict=True)]
        for lo, hi, where in blocks(shape, start, stop):
            ins = [a.filled(where) if isinstance(a, Passage) else a[lo:hi] for a in sources]
            outs = [u.memory[: hi - lo] if isinstance(u, Passage) else u[lo:hi] for u in sinks]
            own = scalars.copy()
            n_invalid, first = kernel(*ins, *outs, own, 0, hi - lo, *options)
            for u in sinks:
                if isinstance(u, Passage):
                    u.empty(where)
            total = total.plus(Tally(n_invalid, first, own), lo)
        return total

    return _in_all(threads.run(by_blocks, n))

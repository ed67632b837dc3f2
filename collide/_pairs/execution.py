"""A call: arguments as a kernel takes them, as they lie or block by block, on as many threads as they are worth.

Every batch function ends in `call`, which knows three ways. Each leaves to the next what is not for it, errors too:

    _direct    float64 arrays, as they lie, all defaults: a call of one pair is little more than that of its kernel
    _usual     arrays of one dtype and numbers, as they lie, any options; large batches on all threads
    _general   whatever else NumPy makes arrays of, broadcast and converted

Python asks as little as it can. A kernel looks itself at what the arrays are, their lengths, layouts and overlaps.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from .._compile import team
from .._compile.allocator import LARGE
from .._compile.kept_memory import fresh
from .._system import threads
from .._typing import Array
from ..errors import InvalidPairError, reason
from .arguments import as_array, broadcast_shape, checked_outputs, gives_nan, result_dtype, truth
from .blocks import Passage, blocks, flat, flat_copy, in_a_line
from .forms import Form
from .loop import REFUSED
from .results import clash, copy_to

Flags = tuple[bool, bool]  # approaching_only, and whether an invalid pair gets NaN

_ndarray, _float64, _empty = np.ndarray, np.float64, np.empty  # looked up nine times a call
_FLOAT64, _FLOAT32 = np.dtype(np.float64), np.dtype(np.float32)
_NOTHING = {dtype.char: np.empty(0, dtype) for dtype in (_FLOAT64, _FLOAT32)}  # the column of a number
_NUMBER = _NOTHING["d"]
_RAISE = "raise"  # a literal is one object
_FEW = LARGE // 8  # pairs whose results are of no account to `fresh`
# Up to so many pairs a copy is cheaper than to find out about layouts, and about what overlaps what.
_SMALL = 1 << 12


class Tally(NamedTuple):
    """The invalid pairs of a share: how many, and of the first the values, and its number."""

    n_invalid: int
    witness: Array

    def plus(self, later: Tally, offset: int = 0) -> Tally:
        """With those of a share that begins at the offset."""
        if self.n_invalid or not later.n_invalid:
            return self._replace(n_invalid=self.n_invalid + later.n_invalid)
        later.witness[-1] += offset
        return later


def call(form: Form, inputs: tuple[Any, ...], approaching_only: Any, invalid: Any, out: Any) -> Sequence[Any]:
    """The outputs of a call, scalars where all inputs are scalars."""
    if approaching_only is False and invalid is _RAISE:
        outputs = _direct(form, inputs, out)
        if outputs is not None:
            return outputs
    outputs, error = attempt(form, inputs, approaching_only, invalid, out)
    if error and invalid == "raise":
        raise error
    return outputs


def attempt(
    form: Form, inputs: tuple[Any, ...], approaching_only: Any, invalid: Any, out: Any
) -> tuple[Sequence[Any], InvalidPairError | None]:
    """The outputs of a call, and the error that tells of its invalid pairs, if there are any."""
    options = truth("approaching_only", approaching_only), gives_nan(invalid, form.invalid)
    outputs, tally = _usual(form, inputs, out, options) or _general(form, inputs, out, options)
    return outputs, _error(form, outputs, tally) if tally else None


def _error(form: Form, outputs: Sequence[Any], tally: Tally) -> InvalidPairError:
    *values, number = tally.witness.tolist()
    index = tuple(int(i) for i in np.unravel_index(int(number), np.shape(outputs[0])))
    pair = dict(zip(form.columns, values, strict=True))
    return InvalidPairError(index, tally.n_invalid, reason(pair))


def _direct(form: Form, inputs: tuple[Any, ...], out: Any) -> Sequence[Any] | None:
    """The outputs of float64 arrays, and a number as the last column, where one thread is enough."""
    like, last = inputs[0], inputs[-1]
    if type(like) is not _ndarray or (like.dtype is not _FLOAT64 and like.dtype != _FLOAT64):
        return None
    n, columns, scalars, n_numbers = like.size, inputs[:-1], _empty(len(inputs) + 1), 0
    if type(last) is float:
        scalars[-2], last, n_numbers = last, _NUMBER, 1
    elif type(last) is not _ndarray:
        return None
    for column in columns:
        if type(column) is not _ndarray:  # Numba asks of other objects at length
            return None
    if not n or (n >= team.LEAST and threads.is_shared(n, team.LEAST)):
        return None
    outputs: Sequence[Array]
    if out is None:
        few = n < _FEW
        outputs = [_empty(n) for _ in form.outputs] if few else fresh(len(form.outputs), like.shape, _FLOAT64, columns)
    elif isinstance(out, tuple):
        outputs = out
        for u in out:
            if type(u) is not _ndarray:
                return None
    else:
        return None
    try:
        # Numba refuses other dtypes and dimensions, and to write to what is read-only.
        n_invalid = form.kernels["dd"].compiled(*columns, last, *outputs, scalars, n_numbers, n, 0, False, form.nan)
    except TypeError:
        return None
    if n_invalid:
        if n_invalid == REFUSED:
            return None
        raise _error(form, outputs, Tally(n_invalid, scalars))
    return outputs


def _usual(form: Form, inputs: tuple[Any, ...], out: Any, options: Flags) -> tuple[Sequence[Any], Tally | None] | None:
    """The outputs of arrays of one dtype and numbers; None where there is anything else, or a fault.

    All that is asked here is whether these are arrays that compiled code knows. It looks itself at sizes, layouts and
    overlaps, sooner than Python could, and refuses what is not for it.
    """
    columns, scalars, numbers = [*inputs], _empty(len(inputs) + 1), []
    like, wide = None, False
    try:
        for i, value in enumerate(inputs):
            kind = type(value)
            if kind is _ndarray:
                like = value
            elif kind is float or kind is int or kind is _float64:
                scalars[i] = value
                numbers.append(i)
                wide = wide or kind is _float64  # which counts for the result's dtype; Python's numbers do not
            else:
                return None
        n, shape, dtype = (1, (), _FLOAT64) if like is None else (like.size, like.shape, like.dtype)
        if not n:
            return None
        result = _FLOAT64 if wide else dtype
        kernel, nothing = form.kernels[dtype.char + result.char].compiled, _NOTHING[dtype.char]
        for i in numbers:
            columns[i] = nothing
        if out is None:
            outputs: Sequence[Any] = fresh(len(form.outputs), shape, result, columns)
        elif isinstance(out, tuple) and all(type(u) is _ndarray for u in out):
            outputs = out
        else:
            return None
        lines = outputs
        if len(shape) != 1:
            columns = [c if c is nothing else in_a_line(c, shape) for c in columns]
            lines = [in_a_line(u, shape) for u in outputs]
        # Numba refuses arrays of more dimensions, and to write to what is read-only, by a TypeError.
        tally = _run(kernel, columns, lines, scalars, len(numbers), n, options)
    except (AttributeError, KeyError, OverflowError, TypeError, ValueError):
        return None
    if tally is not None and tally.n_invalid == REFUSED:
        return None
    return outputs if out is not None or shape else [u[()] for u in outputs], tally


def _run(
    kernel: Callable[..., int],
    columns: Sequence[Array],
    outputs: Sequence[Array],
    scalars: Array,
    n_numbers: int,
    n: int,
    options: Flags,
) -> Tally | None:
    """The pairs of arrays of one dimension, on as many threads as they are worth; None where all are valid."""
    if threads.is_shared(n, team.LEAST):
        n_invalid = team.together(lambda seat: kernel(*columns, *outputs, scalars, n_numbers, n, seat, *options), n)
    else:
        n_invalid = kernel(*columns, *outputs, scalars, n_numbers, n, 0, *options)
    return Tally(n_invalid, scalars) if n_invalid else None


def _in_all(tallies: list[Tally]) -> Tally | None:
    if tallies[0].n_invalid == REFUSED:  # as all do then: each has looked at the whole arrays
        return tallies[0]
    tally = functools.reduce(Tally.plus, tallies)
    return tally if tally.n_invalid else None


def _general(form: Form, inputs: tuple[Any, ...], out: Any, options: Flags) -> tuple[Sequence[Any], Tally | None]:
    """Everything else: other dtypes and layouts, more dimensions, outputs over inputs; and whatever is an error."""
    arrays = [as_array(name, value) for name, value in zip(form.columns, inputs, strict=True)]
    shape = broadcast_shape(form.columns, arrays)
    dtype = result_dtype(inputs, arrays)
    # Size-1 arrays become numbers, so that none becomes a full-length array.
    scalars = np.array([*(float(a.item()) if a.size == 1 else math.nan for a in arrays), -1.0])
    columns = [
        _NOTHING[dtype.char] if a.size == 1 else a if a.shape == shape else np.broadcast_to(a, shape) for a in arrays
    ]
    if out is None:
        targets = outputs = fresh(len(form.outputs), shape, dtype, columns)
    else:
        outputs = checked_outputs(form.outputs, out, shape, dtype)
        apart = math.prod(shape) > _SMALL and not clash(columns, outputs)
        targets = outputs if apart else fresh(len(outputs), shape, dtype, columns)
    kernel = form.kernels[2 * dtype.char].compiled
    tally = _run_converted(kernel, columns, scalars, targets, shape, options)
    if tally is not None and tally.n_invalid == REFUSED:  # an output whose own elements overlap
        targets = fresh(len(outputs), shape, dtype, columns)
        tally = _run_converted(kernel, columns, scalars, targets, shape, options)
    if targets is not outputs:
        copy_to(outputs, targets)
    return outputs if out is not None or shape else [u[()] for u in outputs], tally


def _run_converted(
    kernel: Callable[..., int],
    given: Sequence[Array],
    scalars: Array,
    targets: Sequence[Array],
    shape: tuple[int, ...],
    options: Flags,
) -> Tally | None:
    """What a kernel cannot read or write as it lies passes through blocks, in the cache; a small batch is copied."""
    n, dtype = math.prod(shape), targets[0].dtype
    if not n:
        return None
    n_numbers = sum(a.size == 0 for a in given)
    columns = [flat(a, dtype) for a in given]
    results = [flat(u, dtype) for u in targets]
    if n <= _SMALL:  # what is not flat is an input: the targets are fresh
        columns = [flat_copy(a, dtype) if c is None else c for a, c in zip(given, columns, strict=True)]
    flat_columns = [c for c in columns if c is not None]
    flat_results = [r for r in results if r is not None]
    if len(flat_columns) == len(columns) and len(flat_results) == len(results):
        return _run(kernel, flat_columns, flat_results, scalars, n_numbers, n, options)

    def by_blocks(start: int, stop: int) -> Tally:
        total = Tally(0, scalars)
        sources = [Passage(a, dtype) if c is None else c for a, c in zip(given, columns, strict=True)]
        sinks = [Passage(u, dtype) if r is None else r for u, r in zip(targets, results, strict=True)]
        for lo, hi, where in blocks(shape, start, stop):
            ins = [a.filled(where) if isinstance(a, Passage) else a[lo:hi] for a in sources]
            outs = [u.memory[: hi - lo] if isinstance(u, Passage) else u[lo:hi] for u in sinks]
            own = scalars.copy()
            n_invalid = kernel(*ins, *outs, own, n_numbers, hi - lo, 0, *options)
            if n_invalid == REFUSED:  # as it does of the first block, or of none: see `clash`
                return Tally(REFUSED, own)
            for u in sinks:
                if isinstance(u, Passage):
                    u.empty(where)
            total = total.plus(Tally(n_invalid, own), lo)
        return total

    return _in_all(threads.run(by_blocks, n))

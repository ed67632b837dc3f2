"""A call: arguments as a kernel takes them, as they lie or block by block, on as many threads as they are worth."""

from __future__ import annotations

import functools
import math
import reprlib
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np

from .._compile.lanes import LINE
from .._system import threads
from .._typing import Array
from ..errors import InvalidPairError, reason
from .arguments import WEAK, as_array, broadcast_shape, checked_outputs, gives_nan, overlap
from .forms import Form
from .loop import STREAM_BYTES

Options = tuple[bool, bool]  # approaching_only, and whether an invalid pair gets NaN

_ndarray, _float64, _empty = np.ndarray, np.float64, np.empty  # looked up nine times a call
_FLOAT64, _FLOAT32 = np.dtype(np.float64), np.dtype(np.float32)
_NOTHING = {dtype: np.empty(0, dtype) for dtype in (_FLOAT64, _FLOAT32)}
_BOOLS = bool, np.bool_
# Arguments that a kernel cannot read as they lie are copied, and converted, this many pairs at a time: in the cache.
_BLOCK = 1 << 13
# NumPy's flags C_CONTIGUOUS and WRITEABLE.
_READY, _WRITEABLE = 0x0001, 0x0400
# Up to here a copy is cheaper than thinking: about strides, and about what overlaps what.
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


class Batch(NamedTuple):
    """The inputs of a call: one array or None for each column, and where it is None the number in `scalars`."""

    arrays: list[Array | None]
    scalars: Array
    shape: tuple[int, ...]
    dtype: np.dtype[Any]  # of the result


def resolve(form: Form, inputs: tuple[Any, ...], approaching_only: Any, invalid: Any, out: Any) -> Sequence[Any]:
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
    options = bool(approaching_only), gives_nan(invalid, form.rules)
    outputs, tally = _direct(form, inputs, out, options) or _general(form, inputs, out, options)
    if tally is None:
        return outputs, None
    index = tuple(int(i) for i in np.unravel_index(tally.first, np.shape(outputs[0])))
    pair = dict(zip(form.columns, tally.witness.tolist(), strict=True))
    return outputs, InvalidPairError(index, tally.n_invalid, reason(pair))


def _direct(
    form: Form, inputs: tuple[Any, ...], out: Any, options: Options
) -> tuple[Sequence[Any], Tally | None] | None:
    """Numbers, and arrays of one shape and dtype as a kernel takes them: the common case, in a third of the time.

    Whether outputs overlap inputs is left to the kernel, which refuses. Where that or strides are in the way of a small
    batch, copies are made. None if it is not the common case.
    """
    n, shape, dtype = 0, (), _FLOAT64
    columns, scalars, numbers = [*inputs], _empty(len(inputs)), []
    for i, value in enumerate(inputs):
        kind = type(value)
        if kind is _ndarray:
            if not n:
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
        columns = [c.reshape(-1) for c in columns]
    kernel = form.kernels[dtype].compiled
    if out is None:
        outputs = _new(shape or (1,), dtype, columns, len(form.outputs))
        tally = _call(kernel, columns, outputs, scalars, n or 1, options)
        return outputs if n else [u[0] for u in outputs], tally
    if not n or not isinstance(out, tuple) or len(out) != len(form.outputs):
        return None
    if _all_like(out, dtype, shape):
        tally = _call(kernel, columns, out, scalars, n, options)
        if tally is None or tally.n_invalid > 0:
            return [*out], tally
    if n > _SMALL:
        return None
    outputs = checked_outputs(form.outputs, out, shape, dtype)
    targets = _new(shape, dtype, columns, len(out))
    tally = _call(kernel, columns, targets, scalars, n, options)
    _copy_to(outputs, targets)
    return outputs, tally


def _all_like(arrays: tuple[Any, ...], dtype: Any, shape: tuple[int, ...]) -> bool:
    """Whether a kernel can write its results to these as they lie."""
    ready = _READY | _WRITEABLE
    for a in arrays:  # a loop: the generator of all() takes a third longer
        if type(a) is not _ndarray or a.dtype is not dtype or a.shape != shape or a.flags.num & ready != ready:
            return False
    return True


def _copy_to(outputs: Sequence[Array], targets: Sequence[Array]) -> None:
    for u, target in zip(outputs, targets, strict=True):
        u[...] = target


def _call(
    kernel: Any, columns: Sequence[Array], outputs: Sequence[Array], scalars: Array, n: int, options: Options
) -> Tally | None:
    """The pairs of contiguous arrays, on as many threads as they are worth; -1 are invalid if the kernel refuses."""
    if len(outputs[0].shape) > 1:
        outputs = [u.reshape(-1) for u in outputs]
    if not threads.is_shared(n):
        n_invalid, first = kernel(*columns, *outputs, scalars, 0, n, *options)
        return Tally(n_invalid, first, scalars) if n_invalid else None

    def share(start: int, stop: int) -> Tally:
        own = scalars.copy()
        n_invalid, first = kernel(*columns, *outputs, own, start, stop, *options)
        return Tally(n_invalid, first, own)

    return _in_all(threads.run(share, n))


def _in_all(tallies: list[Tally]) -> Tally | None:
    tally = functools.reduce(Tally.plus, tallies)
    return tally if tally.n_invalid else None


def _general(form: Form, inputs: tuple[Any, ...], out: Any, options: Options) -> tuple[Sequence[Any], Tally | None]:
    """Everything else: other dtypes and layouts, more dimensions, outputs over inputs; and whatever is an error."""
    batch = _any(form.columns, inputs)
    shape, dtype = batch.shape, batch.dtype
    if out is None:
        targets = outputs = _new(shape, dtype, batch.arrays, len(form.outputs))
    else:
        outputs = checked_outputs(form.outputs, out, shape, dtype)
        fresh = outputs[0].size <= _SMALL or _clash(batch, outputs)
        targets = _new(shape, dtype, batch.arrays, len(outputs)) if fresh else outputs
    tally = _run(form.kernels[dtype].compiled, batch, targets, options)
    assert tally is None or tally.n_invalid > 0  # nothing is left that a kernel refuses
    if targets is not outputs:
        _copy_to(outputs, targets)
    return outputs if out is not None or shape else [u[()] for u in outputs], tally


def _any(names: Sequence[str], inputs: Sequence[Any]) -> Batch:
    """Whatever else NumPy makes arrays of. Size-1 arrays become numbers, so that none becomes a full-length array."""
    arrays = [as_array(name, value) for name, value in zip(names, inputs, strict=True)]
    shape = broadcast_shape(names, arrays)
    kinds = [WEAK.get(type(value), a.dtype) for value, a in zip(inputs, arrays, strict=True)]
    dtype = _FLOAT32 if np.result_type(*kinds) in (_FLOAT32, np.float16) else _FLOAT64
    scalars = np.array([float(a.item()) if a.size == 1 else math.nan for a in arrays])
    full = [None if a.size == 1 else a if a.shape == shape else np.broadcast_to(a, shape) for a in arrays]
    return Batch(full, scalars, shape, dtype)


def _new(shape: tuple[int, ...], dtype: np.dtype[Any], inputs: Sequence[Array | None], count: int) -> list[Array]:
    """New outputs. Large ones lie to the cache lines as the first array of their kind among the inputs does.

    Streaming stores need outputs that agree, and a step's loads are then whole lines as well: inputs at an odd 16
    bytes, NumPy's usual, under outputs on a line cost a sixth of the speed, a quarter in polar form.
    """
    item = dtype.itemsize
    size = item * (shape[0] if len(shape) == 1 else math.prod(shape))
    if size < STREAM_BYTES:
        return [_empty(shape, dtype) for _ in range(count)]
    like = next((_address(a) for a in inputs if a is not None and a.size and a.dtype == dtype), 0)
    outputs = []
    for _ in range(count):
        raw = np.empty(size + LINE, np.uint8)
        start = (like - _address(raw)) % LINE // item * item
        outputs.append(raw[start : start + size].view(dtype).reshape(shape))
    return outputs


def _address(array: Array) -> int:
    return array.__array_interface__["data"][0]  # type: ignore[no-any-return]


def _clash(batch: Batch, outputs: Sequence[Array]) -> bool:
    """Whether an output shares memory with an input in any way but element upon element, which is in place."""
    for a in batch.arrays:
        for u in outputs:
            if a is not None and a is not u and overlap(a, u):
                same = a.dtype == u.dtype and a.shape == u.shape and a.strides == u.strides
                if not same or _address(a) != _address(u):
                    return True
    return False


def _run(kernel: Any, batch: Batch, targets: Sequence[Array], options: Options) -> Tally | None:
    """What a kernel cannot read or write as it lies passes through blocks, in the cache; a small batch is copied."""
    shape, dtype, scalars, n = batch.shape, batch.dtype, batch.scalars, targets[0].size
    sources = [_NOTHING[dtype] if a is None else a for a in batch.arrays]
    columns = [_flat(a, dtype) for a in sources]
    results = [_flat(u, dtype) for u in targets]
    if n <= _SMALL:  # what is not flat is an input: the targets are fresh
        columns = [_copy(a, dtype) if c is None else c for a, c in zip(sources, columns, strict=True)]
    flat_columns = [c for c in columns if c is not None]
    flat_results = [r for r in results if r is not None]
    if len(flat_columns) == len(columns) and len(flat_results) == len(results):
        return _call(kernel, flat_columns, flat_results, scalars, n, options)

    def by_blocks(start: int, stop: int) -> Tally:
        total = Tally(0, -1, scalars)
        rooms_in = [_Room(a, dtype) if c is None else c for a, c in zip(sources, columns, strict=True)]
        rooms_out = [_Room(u, dtype) if r is None else r for u, r in zip(targets, results, strict=True)]
        for lo, hi, where in _blocks(shape, start, stop):
            ins = [room.filled(where) if isinstance(room, _Room) else room[lo:hi] for room in rooms_in]
            outs = [room.memory[: hi - lo] if isinstance(room, _Room) else room[lo:hi] for room in rooms_out]
            own = scalars.copy()
            n_invalid, first = kernel(*ins, *outs, own, 0, hi - lo, *options)
            for room in rooms_out:
                if isinstance(room, _Room):
                    room.empty(where)
            total = total.plus(Tally(n_invalid, first, own), lo)
        return total

    return _in_all(threads.run(by_blocks, n))


def _flat(array: Array, dtype: np.dtype[Any]) -> Array | None:
    """The array as a kernel reads it: one contiguous run of native numbers. None where it is not that.

    The kernel must not be left to find out: Numba takes a byte-swapped array for a native one that it has seen.
    """
    if array.dtype == dtype and array.flags.c_contiguous:
        return array if type(array) is np.ndarray and array.ndim == 1 else np.asarray(array).reshape(-1)
    return None


def _copy(array: Array, dtype: np.dtype[Any]) -> Array:
    with np.errstate(invalid="ignore"):  # a signalling NaN on its way to the check
        return np.array(array, dtype).reshape(-1)


class _Room:
    """A block's length of memory through which an array of any dtype, byte order and strides passes."""

    def __init__(self, array: Array, dtype: np.dtype[Any]) -> None:
        self._array = array
        self.memory = np.empty(_BLOCK, dtype)

    def filled(self, where: tuple[Any, ...]) -> Array:
        part = self._array[where]
        with np.errstate(invalid="ignore"):
            np.copyto(self.memory[: part.size].reshape(part.shape), part, casting="unsafe")
        return self.memory[: part.size]

    def empty(self, where: tuple[Any, ...]) -> None:
        part = self._array[where]
        part[...] = self.memory[: part.size].reshape(part.shape)


def _blocks(shape: tuple[int, ...], start: int, stop: int) -> Iterator[tuple[int, int, tuple[Any, ...]]]:
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

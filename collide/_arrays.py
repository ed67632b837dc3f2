"""What the facade does to its arguments: dtype, broadcasting, out, overlap, and every message."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from . import _threads
from ._jit import Kernel
from ._kernels import Form
from ._lanes import LINE
from .errors import InvalidPairError, reason

Array = np.ndarray[Any, np.dtype[Any]]

_FLOAT64, _FLOAT32 = np.dtype(np.float64), np.dtype(np.float32)
_NOTHING = {dtype: np.empty(0, dtype) for dtype in (_FLOAT64, _FLOAT32)}
_RULES = {"raise": False, "keep": False, "nan": True}

# Arguments that a kernel cannot read as they lie are copied, and converted, this many pairs at a time: in the cache.
_BLOCK = 1 << 13
# Up to here writing to fresh arrays and copying is cheaper than looking for overlaps between out and the inputs.
_SMALL = 1 << 12


class Tally(NamedTuple):
    """The invalid pairs of a share: how many, the first, and that one's values."""

    n_invalid: int
    first: int
    witness: Array

    def plus(self, later: Tally, offset: int) -> Tally:
        """With those of a share that begins at the offset."""
        if self.n_invalid or not later.n_invalid:
            return self._replace(n_invalid=self.n_invalid + later.n_invalid)
        return later._replace(first=offset + later.first)


def resolve(form: Form, inputs: tuple[Any, ...], approaching_only: Any, invalid: Any, out: Any) -> Sequence[Any]:
    """The outputs of a batch, scalars where all inputs are scalars."""
    if not isinstance(approaching_only, bool | np.bool_):
        raise TypeError(f"approaching_only = {approaching_only!r}: must be True or False")
    if not isinstance(invalid, str) or invalid not in _RULES:
        raise ValueError(f"invalid = {invalid!r}: must be one of {', '.join(map(repr, _RULES))}")
    return _quick(form, inputs, approaching_only, invalid, out) or _general(
        form, inputs, approaching_only, invalid, out
    )


def _quick(form: Form, inputs: tuple[Any, ...], approaching_only: Any, invalid: Any, out: Any) -> Sequence[Any] | None:
    """A small batch of plain arrays of one dtype and length, and of plain scalars: in 6 us, where `_general` takes 40.

    None where there is anything else about it.
    """
    shape: tuple[int, ...] | None = None
    dtype = _FLOAT64
    columns: list[Array | None] = []
    scalars = np.empty(len(inputs))
    for i, value in enumerate(inputs):
        kind = type(value)
        if kind is np.ndarray:
            if shape is None:
                shape, dtype = value.shape, value.dtype
                if len(shape) != 1 or shape[0] > _SMALL or dtype not in _NOTHING:
                    return None
            elif value.shape != shape or value.dtype is not dtype:
                return None
            columns.append(value)
        elif kind is float or kind is int:
            try:
                scalars[i] = value
            except OverflowError:
                return None
            columns.append(None)
        else:
            return None
    nothing = _NOTHING[dtype]
    outputs = [np.empty(shape or 1, dtype) for _ in form.outputs]
    if out is not None:
        _check_out(form.outputs, out, () if shape is None else shape, dtype)
    witness = np.empty(len(inputs))
    kernel = form.kernels[dtype].compiled
    columns = [nothing if c is None else c for c in columns]
    try:
        tally = kernel(
            *columns, *outputs, scalars, witness, 0, outputs[0].size, bool(approaching_only), _RULES[invalid]
        )
    except TypeError:  # strided or misaligned
        return None
    if out is not None:
        for u, fresh in zip(out, outputs, strict=True):
            u[...] = fresh if shape is not None else fresh[0]
    if tally[0] and invalid == "raise":
        raise _error(form, shape or (), Tally(tally[0], tally[1], witness))
    if out is not None:
        return out  # type: ignore[no-any-return]
    return outputs if shape is not None else [u[0] for u in outputs]


def _error(form: Form, shape: tuple[int, ...], tally: Tally) -> InvalidPairError:
    index = tuple(int(i) for i in np.unravel_index(tally.first, shape))
    return InvalidPairError(
        index, tally.n_invalid, reason(dict(zip(form.columns, tally.witness.tolist(), strict=True)))
    )


def _general(form: Form, inputs: tuple[Any, ...], approaching_only: Any, invalid: Any, out: Any) -> Sequence[Any]:
    arrays = [_array(name, value) for name, value in zip(form.columns, inputs, strict=True)]
    shape = _shape(form.columns, arrays)
    dtype = _result_dtype(inputs, arrays)
    if out is None:
        outputs = [_new(shape, dtype, arrays) for _ in form.outputs]
        targets = outputs
    else:
        _check_out(form.outputs, out, shape, dtype)
        outputs = list(out)
        if outputs[0].size <= _SMALL:
            targets = [np.empty(shape, dtype) for _ in outputs]
        else:
            targets = outputs
            arrays = [_apart(array, shape, outputs) for array in arrays]
    size = targets[0].size
    if size:
        task = _task(form.kernels[dtype], arrays, targets, approaching_only, _RULES[invalid])
        tally = functools.reduce(lambda a, b: a.plus(b, 0), _threads.run(task, size))
    if targets is not outputs:
        for u, target in zip(outputs, targets, strict=True):
            u[...] = target
    if size and tally.n_invalid and invalid == "raise":
        raise _error(form, shape, tally)
    if out is None and not shape:
        return [u[()] for u in outputs]
    return outputs


def _array(name: str, value: Any) -> Array:
    if isinstance(value, np.ma.MaskedArray):
        raise TypeError(f"{name}: masked arrays are not supported; pass .filled(...) or .compressed()")
    try:
        array = np.asarray(value)
    except ValueError as error:
        raise TypeError(f"{name} = {value!r}: must be an array of numbers ({error})") from None
    if array.dtype.kind not in "biuf" or (array.dtype.kind == "f" and array.dtype.itemsize > 8):
        raise TypeError(
            f"{name}: the dtype {array.dtype} is not supported; must be bool, an integer, float16, float32 or float64"
        )
    return array


def _shape(names: Sequence[str], arrays: Sequence[Array]) -> tuple[int, ...]:
    shapes = {array.shape for array in arrays if array.ndim}
    if len(shapes) <= 1:
        return shapes.pop() if shapes else ()
    try:
        return np.broadcast_shapes(*(array.shape for array in arrays))
    except ValueError:
        listed = ", ".join(f"{name} {array.shape}" for name, array in zip(names, arrays, strict=True) if array.ndim)
        raise ValueError(f"the shapes of the arguments do not broadcast together: {listed}") from None


def _result_dtype(inputs: Sequence[Any], arrays: Sequence[Array]) -> np.dtype[Any]:
    """Python scalars are weak, as in NumPy's own arithmetic."""
    weak = (bool, int, float)
    kinds = [value if type(value) in weak else array.dtype for value, array in zip(inputs, arrays, strict=True)]
    return _FLOAT32 if np.result_type(*kinds) in (_FLOAT32, np.float16) else _FLOAT64


def _new(shape: tuple[int, ...], dtype: np.dtype[Any], arrays: Sequence[Array]) -> Array:
    """A new output. A large one lies to the cache lines as the first array of its size among the inputs does.

    Streaming stores need outputs that agree, and a step's loads are then whole lines as well: inputs at an odd 16
    bytes, NumPy's usual, under outputs on a line cost a quarter of the speed.
    """
    size = math.prod(shape) * dtype.itemsize
    if size <= _SMALL * dtype.itemsize:
        return np.empty(shape, dtype)
    raw = np.empty(size + LINE, np.uint8)
    like = next((_address(a) for a in arrays if a.shape == shape and a.dtype == dtype), 0)
    start = (like - _address(raw)) % LINE // dtype.itemsize * dtype.itemsize
    return raw[start : start + size].view(dtype).reshape(shape)


def _address(array: Array) -> int:
    return array.__array_interface__["data"][0]  # type: ignore[no-any-return]


def _check_out(names: Sequence[str], out: Any, shape: tuple[int, ...], dtype: np.dtype[Any]) -> None:
    if not isinstance(out, tuple):
        raise TypeError(f"out = {type(out).__name__}: must be None or a tuple of {len(names)} arrays")
    if len(out) != len(names):
        raise ValueError(f"out has {len(out)} arrays: must have {len(names)}, for {', '.join(names)}")
    for i, u in enumerate(out):
        if not isinstance(u, np.ndarray) or isinstance(u, np.ma.MaskedArray):
            raise TypeError(f"out[{i}] is of type {type(u).__name__}: must be a NumPy array")
        if u.dtype != dtype:
            raise TypeError(f"out[{i}] has dtype {u.dtype}: must have the result's, {dtype}")
        if u.shape != shape:
            raise ValueError(f"out[{i}] has shape {u.shape}: must have the broadcast shape, {shape}")
        if not u.flags.writeable:
            raise ValueError(f"out[{i}] is read-only")
        for j in range(i):
            if _overlap(u, out[j]):
                raise ValueError(f"out[{j}] and out[{i}] share memory")


def _overlap(a: Array, b: Array) -> bool:
    if not np.may_share_memory(a, b):
        return False
    try:
        return np.shares_memory(a, b, max_work=10_000)  # type: ignore[arg-type]  # any number, says NumPy
    except np.exceptions.TooHardError:
        return True


def _apart(array: Array, shape: tuple[int, ...], outputs: Sequence[Array]) -> Array:
    """The input, or a copy where an output overlaps it in any way but element upon element."""
    if array.size == 1:
        return array.copy()
    for u in outputs:
        if array is not u and _overlap(array, u):
            same = array.dtype == u.dtype and array.shape == u.shape and array.strides == u.strides
            if not same or _address(array) != _address(u):
                return array.copy()
    return array


def _task(
    kernel: Kernel, arrays: Sequence[Array], outputs: Sequence[Array], approaching_only: Any, nan_invalid: bool
) -> Callable[[int, int], Tally]:
    """The function that resolves the pairs from start to stop."""
    compiled, dtype, shape = kernel.compiled, outputs[0].dtype, outputs[0].shape
    scalars = np.array([float(a.item()) if a.size == 1 else math.nan for a in arrays])
    sources = [_NOTHING[dtype] if a.size == 1 else a if a.shape == shape else np.broadcast_to(a, shape) for a in arrays]
    targets = [np.asarray(u) for u in outputs]
    columns, results = [_flat(a, dtype) for a in sources], [_flat(u, dtype) for u in targets]

    def call(ins: Sequence[Array], outs: Sequence[Array], start: int, stop: int) -> Tally:
        witness = np.empty(len(scalars))
        tally = compiled(*ins, *outs, scalars, witness, start, stop, bool(approaching_only), nan_invalid)
        return Tally(tally[0], tally[1], witness)

    def straight(start: int, stop: int) -> Tally:
        return call(columns, results, start, stop)  # type: ignore[arg-type]

    def by_blocks(start: int, stop: int) -> Tally:
        total = Tally(0, -1, scalars)
        length = min(_BLOCK, stop - start)
        rooms_in = [_Room(a, length, dtype) if c is None else c for a, c in zip(sources, columns, strict=True)]
        rooms_out = [_Room(u, length, dtype) if r is None else r for u, r in zip(targets, results, strict=True)]
        for lo in range(start, stop, _BLOCK):
            part = slice(lo, min(lo + _BLOCK, stop))
            ins = [room.filled(part) if isinstance(room, _Room) else room[part] for room in rooms_in]
            outs = [room[part] for room in rooms_out]
            tally = call(ins, outs, 0, part.stop - lo)
            for room in rooms_out:
                if isinstance(room, _Room):
                    room.empty(part)
            total = total.plus(tally, lo)
        return total

    return by_blocks if any(flat is None for flat in (*columns, *results)) else straight


def _flat(array: Array, dtype: np.dtype[Any]) -> Array | None:
    """The array as a kernel reads it: one contiguous run of native, aligned numbers. None where it is not that."""
    if array.dtype == dtype and array.flags.c_contiguous and array.flags.aligned:
        return array.reshape(-1)
    return None


class _Room:
    """A block's length of memory through which an array of any dtype, byte order and strides passes."""

    def __init__(self, array: Array, length: int, dtype: np.dtype[Any]) -> None:
        # One-dimensional slices are copied at the speed of the cache, other layouts element by element.
        self._elements = array if array.ndim == 1 else array.flat
        self._memory = np.empty(length, dtype)

    def __getitem__(self, part: slice) -> Array:
        return self._memory[: part.stop - part.start]

    def filled(self, part: slice) -> Array:
        with np.errstate(invalid="ignore"):  # a signalling NaN on its way to the check
            np.copyto(self[part], self._elements[part], casting="unsafe")
        return self[part]

    def empty(self, part: slice) -> None:
        self._elements[part] = self[part]

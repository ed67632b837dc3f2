"""Vectors along the last axis of arrays: their components are columns of a form, which kernels take as they lie."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from .._compile.kept_memory import fresh
from .._typing import Array
from ..errors import InvalidPairError
from . import execution
from .arguments import as_array, broadcast_shape, checked_outputs, result_dtype
from .forms import FORM_2D

_ndarray, _FLOAT64 = np.ndarray, np.dtype(np.float64)
_FORMS = {2: FORM_2D}  # by how many components vectors have
_COMPONENTS = {d: [(slice(None), k) for k in range(d)] for d in _FORMS}
_NAMES = "m1", "m2", "v1", "v2", "n", "restitution"
_VECTORS = "v1", "v2", "n"


def call(inputs: tuple[Any, ...], approaching_only: Any, invalid: Any, out: Any) -> Sequence[Array]:
    """u1 and u2, by m1, m2, v1, v2, n and the restitution."""
    if not _are_rows(*inputs):
        return _general(inputs, approaching_only, invalid, out)
    m1, m2, v1, v2, n, e = inputs
    if out is None:
        out = fresh(2, v1.shape, _FLOAT64, (v1,))
    elif not (isinstance(out, tuple) and len(out) == 2 and _may_take(*out, v1)):
        return _general(inputs, approaching_only, invalid, out)
    # Not by v1.T, whose rows come one by one at three times the price, a fifth of a small call.
    each = _COMPONENTS[v1.shape[1]]
    columns, targets = [v[k] for v in (v1, v2, n) for k in each], [u[k] for u in out for k in each]
    execution.call(_FORMS[v1.shape[1]], (m1, m2, *columns, e), approaching_only, invalid, tuple(targets))
    return out  # type: ignore[no-any-return]


def _are_rows(m1: Any, m2: Any, v1: Any, v2: Any, n: Any, e: Any) -> bool:
    """Whether these are rows of one shape, in float64, and a number each or one for all beside them."""
    if not (type(v1) is type(v2) is type(n) is _ndarray and v1.dtype == v2.dtype == n.dtype == _FLOAT64):
        return False
    shape = v1.shape
    if len(shape) != 2 or shape[1] not in _FORMS or v2.shape != shape or n.shape != shape:
        return False
    return all(type(x) is float or (type(x) is _ndarray and x.shape == shape[:1]) for x in (m1, m2, e))


def _may_take(u1: Any, u2: Any, v1: Array) -> bool:
    """Whether these arrays can take the results of rows like v1, as far as that is soon told."""
    return (
        type(u1) is type(u2) is np.ndarray
        and u1.shape == u2.shape == v1.shape
        and u1.dtype == u2.dtype == v1.dtype
        and not np.may_share_memory(u1, u2)
    )


def _general(inputs: tuple[Any, ...], approaching_only: Any, invalid: Any, out: Any) -> Sequence[Array]:
    given = dict(zip(_NAMES, inputs, strict=True))
    arrays = {name: v if _is_usual(v) else as_array(name, v) for name, v in given.items()}
    d = _components(arrays)
    shape = broadcast_shape(arrays, arrays.values(), _VECTORS)
    dtype = result_dtype(inputs, arrays.values())
    if out is None:
        outputs = fresh(2, (*shape, d), dtype, [arrays["v1"]])
    else:
        outputs = checked_outputs(("u1", "u2"), out, (*shape, d), dtype)
    components = [c for name in _VECTORS for c in _columns(arrays[name], shape)]
    # Numbers as they were given: as arrays they would count for the dtype of the result.
    columns = given["m1"], given["m2"], *components, given["restitution"]
    targets = tuple(c for u in outputs for c in _columns(u, shape))
    try:
        execution.call(_FORMS[d], columns, approaching_only, invalid, targets)
    except InvalidPairError as error:
        raise error if shape else InvalidPairError((), error.count, error.reason) from None
    return outputs


def _is_usual(value: Any) -> bool:
    return type(value) is np.ndarray and value.dtype.char in "df"


def check_length(name: str, shape: tuple[int, ...]) -> None:
    """Whether the last axis is that of vectors that there is a form for."""
    if not shape or shape[-1] not in _FORMS:
        lengths = " or ".join(map(str, _FORMS))
        raise ValueError(f"{name} has shape {shape}: its last axis must have length {lengths}, one a component")


def _components(arrays: dict[str, Array]) -> int:
    """How many the vectors have."""
    for name in _VECTORS:
        check_length(name, arrays[name].shape)
        if arrays[name].shape[-1] != arrays["v1"].shape[-1]:
            raise ValueError(f"{name} has shape {arrays[name].shape}: its last axis must have the length of that of v1")
    return int(arrays["v1"].shape[-1])


def _columns(vectors: Array, shape: tuple[int, ...]) -> list[Any]:
    """The components, of the batch's one pair as arrays of one, of one vector for all pairs as numbers."""
    if vectors.ndim > 1:
        return [vectors[..., k] for k in range(vectors.shape[-1])]
    return [*vectors] if shape else [vectors[k : k + 1] for k in range(vectors.size)]

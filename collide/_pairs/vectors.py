"""Vectors along the last axis of arrays: their components are columns of a form, which kernels take as they lie."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from .._compile.kept_memory import fresh
from .._typing import Array
from ..errors import InvalidPairError
from . import execution
from .arguments import as_array, broadcast_shape, checked_outputs, result_dtype
from .forms import FORM_2D, FORM_3D

_ndarray, _FLOAT64 = np.ndarray, np.dtype(np.float64)
FORMS = {2: FORM_2D, 3: FORM_3D}  # by how many components vectors have
_COMPONENTS = {d: [(slice(None), k) for k in range(d)] for d in FORMS}
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
    execution.call(FORMS[v1.shape[1]], (m1, m2, *columns, e), approaching_only, invalid, tuple(targets))
    return out  # type: ignore[no-any-return]


def _are_rows(m1: Any, m2: Any, v1: Any, v2: Any, n: Any, e: Any) -> bool:
    """Whether these are rows of one shape, in float64, and a number each or one for all beside them."""
    if not (type(v1) is type(v2) is type(n) is _ndarray and v1.dtype == v2.dtype == n.dtype == _FLOAT64):
        return False
    shape = v1.shape
    if len(shape) != 2 or shape[1] not in FORMS or v2.shape != shape or n.shape != shape:
        return False
    return all(type(x) is float or (type(x) is _ndarray and x.shape == shape[:1]) for x in (m1, m2, e))


def _may_take(u1: Any, u2: Any, v1: Array) -> bool:
    """Whether these arrays can take the results of rows like v1, as far as that is soon told."""
    return (
        type(u1) is type(u2) is np.ndarray
        and u1.shape == u2.shape == v1.shape
        and u1.dtype == u2.dtype == v1.dtype
        and u1.flags.writeable
        and u2.flags.writeable  # or it would be told of a component, by another number
        and not np.may_share_memory(u1, u2)
    )


def _general(inputs: tuple[Any, ...], approaching_only: Any, invalid: Any, out: Any) -> Sequence[Array]:
    given = dict(zip(_NAMES, inputs, strict=True))
    arrays = {name: v if _is_usual(v) else as_array(name, v) for name, v in given.items()}
    d = length_of({name: arrays[name].shape for name in _VECTORS})
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
        execution.call(FORMS[d], columns, approaching_only, invalid, targets)
    except InvalidPairError as error:
        raise error if shape else InvalidPairError((), error.count, error.reason) from None
    return outputs


def _is_usual(value: Any) -> bool:
    return type(value) is np.ndarray and value.dtype.char in "df"


def length_of(shapes: Mapping[str, tuple[int, ...]]) -> int:
    """How many components the vectors of v1 and the others have: one number for all, that there is a form for."""
    d = shapes["v1"][-1] if shapes["v1"] else 0
    for name, shape in shapes.items():
        if not shape or shape[-1] not in FORMS:
            lengths = " or ".join(map(str, FORMS))
            raise ValueError(f"{name} has shape {shape}: its last axis must have length {lengths}, one a component")
        if shape[-1] != d:
            raise ValueError(f"{name} has shape {shape}: its last axis must have length {d}, as that of v1")
    return d


def _columns(vectors: Array, shape: tuple[int, ...]) -> list[Any]:
    """The components, of the batch's one pair as arrays of one, of one vector for all pairs as numbers."""
    if vectors.ndim > 1:
        return [vectors[..., k] for k in range(vectors.shape[-1])]
    return [*vectors] if shape else [vectors[k : k + 1] for k in range(vectors.size)]

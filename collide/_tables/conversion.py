"""Columns of NumPy's as Arrow holds them, and the other way round, where all that is in them is kept."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pyarrow as pa

from .._typing import Array
from .arrow_batches import from_numpy
from .by_name import TableError, cannot_hold
from .stream import ArrowTable, Block, NumpyTable

_NAT = np.iinfo(np.int64).min  # NumPy's word for no date
_UNITS = ("s", "ms", "us", "ns")


def to_arrow(table: NumpyTable, names: Sequence[str], target: str) -> ArrowTable:
    """Single numbers are repeated in every row."""
    types, single = {}, {}
    for name in names:
        dtype = table.rows[name] if name in table.rows else table.whole[name].shaped.dtype
        types[name] = _arrow_type(dtype)
        if types[name] is None:
            raise cannot_hold(name, f"has dtype {dtype}", target)
        if name in table.whole:
            column = table.whole[name]
            if column.shaped.ndim:
                raise cannot_hold(name, f"has shape {column.shaped.shape}, not a value a row", target)
            single[name] = column.load()
    schema = pa.schema(list(types.items()))

    def of(block: Block) -> Any:
        rows = {**table.of(block), **{name: np.full(block.n_rows, value) for name, value in single.items()}}
        return pa.RecordBatch.from_arrays(
            [_to_arrow(name, rows[name], kind, block.start) for name, kind in types.items()], schema=schema
        )

    return ArrowTable(schema, of)


def _arrow_type(dtype: np.dtype[Any]) -> Any:
    """None: there is none."""
    if dtype.kind in "biuf" and dtype.itemsize <= 8:
        return pa.from_numpy_dtype(dtype.newbyteorder("="))
    if dtype.kind in "Mm":
        unit, count = np.datetime_data(dtype)
        if count == 1 and unit in _UNITS:
            return pa.timestamp(unit) if dtype.kind == "M" else pa.duration(unit)
        return pa.date32() if (dtype.kind, unit, count) == ("M", "D", 1) else None
    return {"U": pa.string(), "S": pa.binary()}.get(dtype.kind)


def _to_arrow(name: str, rows: Array, kind: Any, start: int) -> Any:
    rows = np.ascontiguousarray(rows, rows.dtype.newbyteorder("="))
    if rows.dtype.kind in "iuf":
        return from_numpy(rows)
    if pa.types.is_date32(kind):
        days = rows.view(np.int64)
        (beyond,) = np.nonzero((days != _NAT) & (days != days.astype(np.int32)))  # which pyarrow writes as other dates
        for row in beyond[:1] + start:
            raise TableError(
                f"column {name}: row {row}: is a date that {kind} cannot hold: choose another format", int(row)
            )
    try:
        return pa.array(rows, kind)
    except (pa.ArrowException, UnicodeError) as error:
        where = f"column {name}: rows {start} to {start + len(rows) - 1}"
        raise TableError(f"{where}: cannot be written as {kind} ({error})") from None


def to_numpy(table: ArrowTable, target: str) -> NumpyTable:
    """Text is of any length; dictionaries are what they stand for."""
    dtypes: dict[str, np.dtype[Any]] = {}
    for field in table.schema:
        dtype = _numpy_dtype(field.type)
        if dtype is None:
            raise cannot_hold(field.name, f"has type {field.type}", target)
        if field.name in dtypes:
            raise TableError(f"column {field.name}: there are two of that name, which {target} cannot hold")
        dtypes[field.name] = dtype

    def of(block: Block) -> dict[str, Array]:
        columns = zip(dtypes, table.of(block).columns, strict=True)
        return {name: _to_numpy(name, column, dtypes[name], block.start, target) for name, column in columns}

    return NumpyTable(dtypes, {}, of)


def _numpy_dtype(kind: Any) -> np.dtype[Any] | None:
    """None: there is none."""
    if pa.types.is_dictionary(kind):
        return _numpy_dtype(kind.value_type)
    if pa.types.is_integer(kind) or pa.types.is_floating(kind) or pa.types.is_boolean(kind):
        return np.dtype(kind.to_pandas_dtype())  # type: ignore[no-any-return]
    if pa.types.is_timestamp(kind) and kind.tz is None:
        return np.dtype(f"M8[{kind.unit}]")
    if pa.types.is_duration(kind):
        return np.dtype(f"m8[{kind.unit}]")
    if pa.types.is_date32(kind):
        return np.dtype("M8[D]")
    return np.dtype("U") if is_text(kind) else None


def is_text(kind: Any) -> bool:
    return bool(pa.types.is_string(kind) or pa.types.is_large_string(kind) or pa.types.is_string_view(kind))


def _to_numpy(name: str, column: Any, dtype: np.dtype[Any], start: int, target: str) -> Array:
    if pa.types.is_dictionary(column.type):
        column = column.dictionary_decode()
    if dtype.kind in "Mm":
        numbers = column.cast(pa.int32()) if pa.types.is_date32(column.type) else column
        return np.from_dlpack(numbers.cast(pa.int64()).fill_null(_NAT)).view(dtype)
    if column.null_count:
        row = start + column.is_null().index(True).as_py()
        raise TableError(f"column {name}: row {row}: is null, which {target} cannot hold: choose another format", row)
    if dtype.kind == "U":
        texts = column.to_pylist()
        row = next((start + k for k, text in enumerate(texts) if text.endswith("\0")), None)
        if row is not None:
            raise TableError(f"column {name}: row {row}: ends with a NUL, which NumPy takes from text", row)
        return np.array(texts or [""], dtype)[: len(texts)]
    if dtype.kind == "b":
        return np.from_dlpack(column.cast(pa.uint8())).view(bool)
    return np.from_dlpack(column)

"""The argument columns, out of what Arrow has in memory, and the results, as Arrow holds them.

Not by pa.array, to_numpy and empty_table: they import pandas where it is installed, which takes 0.15 s.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pyarrow as pa

from .._typing import Array
from . import by_name
from .by_name import ColumnTypeError, TableError


def no_rows(schema: Any, columns: by_name.Columns) -> Any:
    """A batch of the argument columns. Of others, pyarrow cannot make an empty one of every type."""
    fields = [schema.field(name) for name in columns.inputs.values()]
    return pa.RecordBatch.from_arrays([pa.nulls(0, field.type) for field in fields], schema=pa.schema(fields))


def to_numpy(batch: Any, columns: by_name.Columns, start: int) -> dict[str, Array]:
    """The argument columns, by their arguments' names, where they lie, bits apart. `start`: the batch's first row."""
    arrays = {}
    for argument, name in columns.inputs.items():
        column = batch.column(name)
        kind = column.type
        if not (pa.types.is_integer(kind) or pa.types.is_floating(kind) or pa.types.is_boolean(kind)):
            raise ColumnTypeError(f"column {name}: has type {kind}, must be a real number")
        if column.null_count:
            row = start + column.is_null().index(True).as_py()
            raise TableError(
                f"column {name}: row {row}: is null ({by_name.counted(column.null_count, 'null')} from here on)"
            )
        arrays[argument] = np.from_dlpack(column.cast(pa.uint8()) if pa.types.is_boolean(kind) else column)
    return arrays


def from_numpy(u: Array) -> Any:
    """A column of results, without a copy."""
    return pa.Array.from_buffers(pa.from_numpy_dtype(u.dtype), u.size, [None, pa.py_buffer(u)])

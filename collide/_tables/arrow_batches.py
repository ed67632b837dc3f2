"""The argument columns, out of what Arrow has in memory."""

from __future__ import annotations

from typing import Any

import pyarrow as pa

from .._typing import Array
from . import by_name
from .by_name import ColumnTypeError, TableError


def no_rows(schema: Any, columns: by_name.Columns) -> Any:
    """A table of the argument columns. Of others, pyarrow cannot make an empty one of every type."""
    return pa.schema([schema.field(name) for name in columns.inputs.values()]).empty_table()


def to_numpy(batch: Any, columns: by_name.Columns, start: int) -> dict[str, Array]:
    """The argument columns, by their arguments' names, without a copy. `start`: the number of the batch's first row."""
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
        if isinstance(column, pa.ChunkedArray):
            column = column.combine_chunks()
        arrays[argument] = column.to_numpy(zero_copy_only=False)
    return arrays

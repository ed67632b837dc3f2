"""Tables in NumPy's own formats: what they have in common."""

from __future__ import annotations

import zipfile
import zlib
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from .._typing import Array
from . import stream
from .by_name import Columns, ColumnTypeError, TableError, counted
from .stream import ArrowTable, Source

# What zipfile and NumPy raise for damage, encryption, methods unknown to them, pickles and sizes out of reach.
UNREADABLE = (
    OSError,
    ValueError,
    EOFError,
    KeyError,
    RuntimeError,
    MemoryError,
    zipfile.BadZipFile,
    zlib.error,
)


_BLOCK_BYTES = 1 << 24  # where rows are long, a block has fewer of them


def rows_of_a_block(dtypes: Iterable[np.dtype[Any]]) -> int:
    return max(1, min(stream.ROWS, _BLOCK_BYTES // max(1, sum(dtype.itemsize for dtype in dtypes))))


class NumpySource(Source):
    """What it holds as NumPy does, Arrow can hold in part."""

    def as_arrow(self, target: str) -> ArrowTable:
        from .conversion import to_arrow  # needs pyarrow

        return to_arrow(self.as_numpy(target), self.names, target)


def is_by_rows(column: Array, n_rows: int | None) -> bool:
    return column.shape == (n_rows,) and column.dtype.kind in "biufUSMm"


def n_rows_of(columns: Columns, arrays: Mapping[str, Array]) -> int | None:
    """The length of the argument columns, which has to be one, or they are single numbers; None if all are."""
    length, first = None, ""
    for argument, column in arrays.items():
        name = columns.inputs[argument]
        if column.ndim > 1:
            raise TableError(f"column {name}: has {column.ndim} dimensions, must have 1")
        if column.dtype.kind not in "biuf" or column.dtype.itemsize > 8:
            raise ColumnTypeError(f"column {name}: has dtype {column.dtype}, must be a real number")
        if column.ndim == 1 and length is None:
            length, first = column.shape[0], name
        if column.ndim == 1 and column.shape[0] != length:
            rows = min(column.shape[0], length or 0)
            raise TableError(
                f"column {name}: has {counted(column.shape[0], 'row')} where {first} has {length:,}; "
                f"they part at row {rows}"
            )
    return length


def why(error: BaseException) -> str:
    return " ".join(str(error).split()) or type(error).__name__

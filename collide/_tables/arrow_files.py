"""Tables in the formats of pyarrow, of any size: what they have in common."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import pyarrow as pa

from .._system.messages import reason
from .._typing import Array
from .arrow_batches import from_numpy, no_rows, to_numpy
from .by_name import Columns, TableError
from .stream import Block, Source, check_size, size

UNREADABLE = (pa.ArrowException, OSError, EOFError, UnicodeError)
BLOCK_BYTES = 1 << 24  # where rows are long, a block has fewer of them


class ArrowFile(Source):
    """A block is a record batch, and its results are columns after the others."""

    schema: Any
    _columns: Columns
    _file: Any

    def __init__(self, path: Path) -> None:
        try:
            self._file = opened(path, "rb")
        except OSError as error:
            raise TableError(f"cannot be read ({reason(error)})") from None
        self._size = size(self._file.fileno())

    def close(self) -> None:
        self._file.close()

    def select(self, columns: Columns) -> dict[str, Array]:
        self._columns = columns
        return to_numpy(no_rows(self.schema, columns), columns, 0)

    def blocks(self) -> Iterator[Block]:
        start = 0
        try:
            for batch in self._batches():
                yield Block(start, batch.num_rows, self._numbers(batch, start), batch)
                start += batch.num_rows
        except (*UNREADABLE, TableError) as error:
            self._check(start)
            if isinstance(error, TableError):
                raise
            raise TableError(self._located(error, start)) from None
        self._check(start)

    def _check(self, start: int) -> None:
        check_size(self._file.fileno(), self._size, f"row {start}")

    def _batches(self) -> Iterator[Any]:
        raise NotImplementedError

    def _numbers(self, batch: Any, start: int) -> dict[str, Array]:
        return to_numpy(batch, self._columns, start)

    def _located(self, error: BaseException, start: int) -> str:
        """What is wrong, and where: it is looked for once more, column by column."""
        for name in self.names:
            row = 0
            try:
                for batch in self._column(name):
                    row += batch.num_rows
            except UNREADABLE as again:
                return f"column {name}: row {row}: cannot be read ({why(again)})"
        return f"row {start}: cannot be read ({why(error)})"

    def _column(self, name: str) -> Iterator[Any]:
        """The batches of one column only."""
        raise NotImplementedError


def why(error: BaseException) -> str:
    return " ".join(str(error).split()).removesuffix(".")


def opened(path: Path, mode: str) -> Any:
    """By the bytes of its name, which need not be text, and which pyarrow takes for no address of something else."""
    return pa.OSFile(os.fsencode(path), mode)


def joined(schema: Any, block: Block, results: Sequence[Array]) -> Any:
    """The batch with its results, under the schema of both."""
    columns = [_compact(column) for column in block.rest.columns]
    return pa.RecordBatch.from_arrays([*columns, *map(from_numpy, results)], schema=schema)


@contextlib.contextmanager
def written(start: int) -> Iterator[None]:
    """Where rows from this one on are written, and damage shows that reading has not seen."""
    try:
        yield
    except pa.ArrowException as error:
        raise TableError(f"row {start}: cannot be read, or not be written ({why(error)})") from None


def _compact(column: Any) -> Any:
    """Without what lies beyond a slice: of views, each slice would be written with the data of all."""
    kind = column.type
    if pa.types.is_string_view(kind):
        return column.cast(pa.large_string()).cast(kind)
    if pa.types.is_binary_view(kind):
        return column.cast(pa.large_binary()).cast(kind)
    return column


def extended(schema: Any, outputs: dict[str, Array]) -> Any:
    for name, u in outputs.items():
        schema = schema.append(pa.field(name, pa.from_numpy_dtype(u.dtype)))
    return schema

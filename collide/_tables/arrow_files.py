"""Tables in the formats of pyarrow, of any size: what they have in common."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa

from .._system.messages import reason
from .._typing import Array
from .arrow_batches import from_numpy, no_rows, to_numpy
from .by_name import Columns, TableError
from .conversion import to_numpy as converted
from .standard import Input, Place
from .stream import ArrowTable, Block, NumpyTable, Sink, Source, check_size, size

UNREADABLE = (pa.ArrowException, OSError, EOFError, UnicodeError)
BLOCK_BYTES = 1 << 24  # where rows are long, a block has fewer of them


class ArrowFile(Source):
    """A block is a record batch."""

    schema: Any
    _columns: Columns
    _file: Any

    def __init__(self, place: Path | Input) -> None:
        self._place = place
        if isinstance(place, Input):
            self._file, self._size = pa.PythonFile(place, "r"), None
            return
        try:
            self._file = opened(place)
        except OSError as error:
            raise TableError(f"cannot be read ({reason(error)})") from None
        self._size = size(self._file.fileno())

    def stop(self) -> None:
        if isinstance(self._place, Input):
            self._place.close()

    def close(self) -> None:
        self._file.close()

    def select(self, columns: Columns) -> dict[str, Array]:
        self._columns = columns
        return to_numpy(no_rows(self.schema, columns), columns, 0)

    def as_arrow(self, target: str) -> ArrowTable:
        return ArrowTable(self.schema, lambda block: block.table)

    def as_numpy(self, target: str) -> NumpyTable:
        return converted(self.as_arrow(target), target)

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
            raise self._located(error, start) from None
        self._check(start)

    def _check(self, start: int) -> None:
        if self._size is not None:
            check_size(self._file.fileno(), self._size, f"row {start}")

    def _batches(self) -> Iterator[Any]:
        raise NotImplementedError

    def _numbers(self, batch: Any, start: int) -> dict[str, Array]:
        return to_numpy(batch, self._columns, start)

    def _located(self, error: BaseException, start: int) -> TableError:
        """What is wrong, and where: it is looked for once more, column by column, where that can be done."""
        for name in self.names if self._size is not None else ():
            row = 0
            try:
                for batch in self._column(name):
                    row += batch.num_rows
            except UNREADABLE as again:
                return TableError(f"column {name}: row {row}: cannot be read ({why(again)})")
        return TableError(f"row {start}: cannot be read ({why(error)})")

    def _column(self, name: str) -> Iterator[Any]:
        """The batches of one column only."""
        raise NotImplementedError


def why(error: BaseException) -> str:
    return " ".join(str(error).split()).removesuffix(".")


def opened(path: Path, mode: str = "rb") -> Any:
    """By the bytes of its name, which need not be text, and which pyarrow takes for no address of something else."""
    return pa.OSFile(os.fsencode(path), mode)


def created(place: Place) -> contextlib.AbstractContextManager[Any]:
    """A new file of pyarrow's, which is closed at the end, or standard output, which is not."""
    if isinstance(place, Path):
        return opened(place, "wb")  # type: ignore[no-any-return]
    return contextlib.nullcontext(pa.PythonFile(place, "w"))


class ArrowSink(Sink):
    """A record batch is written as it is read, with its results as columns after the others."""

    def __init__(self, source: Source, outputs: dict[str, Array], target: str) -> None:
        self._table = source.as_arrow(target)
        self._schema = extended(self._table.schema, outputs)

    def _joined(self, block: Block, results: Sequence[Array]) -> Any:
        """The batch of a block with its results, under the schema of both."""
        columns = [_compact(column) for column in self._table.of(block).columns]
        results = [np.atleast_1d(u) for u in results]
        return pa.RecordBatch.from_arrays([*columns, *map(from_numpy, results)], schema=self._schema)


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

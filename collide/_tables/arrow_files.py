"""Tables in the formats of pyarrow, of any size: what they have in common, and Parquet."""

from __future__ import annotations

import contextlib
import functools
import os
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq

from .._typing import Array
from . import stream
from .arrow_batches import from_numpy, no_rows, to_numpy
from .by_name import Columns, TableError
from .stream import Block, Source, Write, check_size, size

UNREADABLE = (pa.ArrowException, OSError, EOFError, UnicodeError)
BLOCK_BYTES = 1 << 24  # where rows are long, a block has fewer of them
_FIRST = 1 << 10  # rows, from which the size of all is told


class ArrowFile(Source):
    """A block is a record batch, and its results are columns after the others."""

    schema: Any
    _columns: Columns
    _file: Any

    def __init__(self, path: Path) -> None:
        try:
            self._file = opened(path, "rb")
        except OSError as error:
            raise TableError(f"cannot be read ({os.strerror(error.errno or 0)})") from None
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


def write_joined(writer: Any, schema: Any, block: Block, results: Sequence[Array]) -> None:
    """The batch with its results, under the schema of both."""
    try:
        columns = [_compact(column) for column in block.rest.columns]
        writer.write_batch(pa.RecordBatch.from_arrays([*columns, *map(from_numpy, results)], schema=schema))
    except pa.ArrowException as error:  # damage that shows only here
        raise TableError(f"row {block.start}: cannot be read, or not be written ({why(error)})") from None


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


class Parquet(ArrowFile):
    """The output is compressed and encoded as the input is. Each block is a row group."""

    def __init__(self, path: Path) -> None:
        super().__init__(path)
        try:
            self._metadata = pq.read_metadata(self._file)
            # Buffered, or a column of a whole row group would be read at once, and be in memory as it lies in the file.
            each = max(1 << 14, BLOCK_BYTES // max(1, self._metadata.num_columns))
            self._table = pq.ParquetFile(self._file, metadata=self._metadata, buffer_size=each, pre_buffer=False)
            self.schema = self._table.schema_arrow
            self.names, self.n_rows = list(self.schema.names), self._metadata.num_rows
        except UNREADABLE as error:
            raise TableError(f"cannot be read as Parquet ({why(error)})") from None

    def _batches(self) -> Iterator[Any]:
        n_read = 0
        for g in range(self._metadata.num_row_groups):
            for batch in self._table.iter_batches(self._n_rows_of(g), row_groups=[g]):
                n_read += batch.num_rows
                yield batch
        if n_read < self._metadata.num_rows:  # of which pyarrow says nothing
            raise EOFError(f"there are {n_read:,} rows, not {self._metadata.num_rows:,}")

    def _n_rows_of(self, g: int) -> int:
        """Of a block of this row group, by its first rows as they are in memory, and by all of it as it is stored."""
        group = self._metadata.row_group(g)
        first = next(self._table.iter_batches(_FIRST, row_groups=[g]), None)
        if first is None:
            return stream.ROWS
        longest = max(first.get_total_buffer_size() / first.num_rows, group.total_byte_size / group.num_rows)
        return max(1, min(stream.ROWS, int(BLOCK_BYTES / longest)))

    def _column(self, name: str) -> Iterator[Any]:
        for g in range(self._metadata.num_row_groups):
            yield from self._table.iter_batches(_FIRST, row_groups=[g], columns=[name])

    @contextlib.contextmanager
    def sink(self, path: Path, outputs: dict[str, Array]) -> Iterator[Write]:
        schema = extended(self.schema, outputs)
        with opened(path, "wb") as file, pq.ParquetWriter(file, schema, **self._as_here(outputs)) as writer:
            yield functools.partial(write_joined, writer, schema)

    def _as_here(self, outputs: dict[str, Array]) -> dict[str, Any]:
        if not self._metadata.num_row_groups:
            return {}
        group = self._metadata.row_group(0)
        columns = [group.column(c) for c in range(group.num_columns)]
        codecs = {c.path_in_schema: c.compression.replace("UNCOMPRESSED", "NONE") for c in columns}
        usual = codecs[self._columns.inputs["m1"]]
        return {
            "compression": {**codecs, **dict.fromkeys(outputs, usual)},
            "use_compliant_nested_type": False,  # nor are the parts of nested columns renamed
            "use_dictionary": [c.path_in_schema for c in columns if any("DICTIONARY" in e for e in c.encodings)],
        }

"""Tables as Parquet, of any size.

Of its two halves, reading and resolving take as long as encoding and writing. So row groups are written by a thread of
their own, while the blocks of the next one come.
"""

from __future__ import annotations

import contextlib
import functools
import itertools
import math
import operator
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq

from .._typing import Array
from . import arrow_files, stream
from .arrow_files import UNREADABLE, ArrowFile, ArrowSink, created, why, written
from .by_name import TableError, cannot_hold
from .conversion import is_text
from .standard import Place
from .stream import Block, Source, Write, behind

GROUP_BYTES = 1 << 27  # of a row group in memory, where up to two are at a time
_FIRST = 1 << 10  # rows, from which the size of all is told
_WIDTHS = {"INT32": 4, "FLOAT": 4, "INT64": 8, "DOUBLE": 8}  # of a value that stands in no dictionary


class Parquet(ArrowFile):
    """Row groups may be larger than memory: they are read by pages."""

    def __init__(self, path: Path) -> None:
        super().__init__(path)
        try:
            self._metadata = pq.read_metadata(self._file)
            # Buffered, or a column of a whole row group would be read at once, and be in memory as it lies in the file.
            each = max(1 << 14, arrow_files.BLOCK_BYTES // max(1, self._metadata.num_columns))
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
        return max(1, min(stream.ROWS, int(arrow_files.BLOCK_BYTES / longest)))

    def _column(self, name: str) -> Iterator[Any]:
        for g in range(self._metadata.num_row_groups):
            yield from self._table.iter_batches(_FIRST, row_groups=[g], columns=[name])

    def ends(self) -> set[int]:
        """Of the row groups, the numbers of rows up to there."""
        groups = map(self._metadata.row_group, range(self._metadata.num_row_groups))
        return set(itertools.accumulate(group.num_rows for group in groups))

    def how(self, outputs: dict[str, Array]) -> dict[str, Any]:
        """How it is compressed and encoded, as the options of a writer that writes the results as well."""
        if not self._metadata.num_row_groups:
            return {}
        group = self._metadata.row_group(0)
        columns = [group.column(c) for c in range(group.num_columns)]
        codecs = {c.path_in_schema: c.compression.replace("UNCOMPRESSED", "NONE") for c in columns}
        usual = codecs[self._columns.inputs["m1"]]
        return {
            "compression": {**codecs, **dict.fromkeys(outputs, usual)},
            "use_compliant_nested_type": False,  # nor are the parts of nested columns renamed
            "use_dictionary": [c.path_in_schema for c in columns if _by_dictionary(c)],
            "max_rows_per_page": stream.ROWS,  # or pages end after 20,000, where pyarrow is half as fast as at 1 MiB
        }


class ParquetSink(ArrowSink):
    """With the row groups of a Parquet source, compressed and encoded as there; what is too large, in several."""

    def __init__(self, source: Source, outputs: dict[str, Array]) -> None:
        super().__init__(source, outputs, "a .parquet file")
        self._size: Callable[[Any], int]
        if isinstance(source, Parquet):
            self._ends, self._how = source.ends(), source.how(outputs)
            self._size = operator.methodcaller("get_total_buffer_size")
        else:
            for field in self._table.schema:
                if self._table.schema.names.count(field.name) > 1:
                    raise TableError(
                        f"column {field.name}: there are several of that name, which Parquet's readers refuse"
                    )
                _check_type(field)
            texts = [field.name for field in self._table.schema if is_text(field.type)]
            self._ends, self._how = set(), {"use_dictionary": texts, "max_rows_per_page": stream.ROWS}
            self._size = operator.attrgetter("nbytes")  # a block may be a slice of what is much larger

    @contextlib.contextmanager
    def open(self, place: Place) -> Iterator[Write]:
        coming: list[Any] = []  # of the next row group
        with (
            created(place) as file,
            pq.ParquetWriter(file, self._schema, **self._how) as writer,
            behind(functools.partial(_write, writer)) as write_behind,
        ):

            def end_group(end: int) -> None:
                group = pa.Table.from_batches(coming)
                coming.clear()
                write_behind(end - group.num_rows, group)

            end = 0

            def write(block: Block, results: Sequence[Array]) -> None:
                nonlocal end
                with written(block.start):
                    coming.append(self._joined(block, results))
                end = block.start + block.n_rows
                if end in self._ends or sum(map(self._size, coming)) >= GROUP_BYTES:
                    end_group(end)

            yield write
            if coming:
                end_group(end)


def _check_type(field: Any) -> None:
    """Whether it can be written, by trying: no list would be that of each pyarrow."""
    schema = pa.schema([field.with_nullable(True)])
    try:
        batch = pa.RecordBatch.from_arrays([pa.nulls(1, field.type)], schema=schema)
        with pq.ParquetWriter(pa.BufferOutputStream(), schema) as writer:
            writer.write_batch(batch)
    except pa.ArrowException:
        raise cannot_hold(field.name, f"has type {field.type}", "a .parquet file") from None


def _write(writer: Any, start: int, group: Any) -> None:
    with written(start):
        writer.write_table(group, group.num_rows)


def _by_dictionary(column: Any) -> bool:
    """Whether the values stand in a dictionary. One that saves nothing was given up halfway, and takes long to try."""
    plain = column.num_values * _WIDTHS.get(column.physical_type, math.inf)
    return any("DICTIONARY" in e for e in column.encodings) and column.total_uncompressed_size < plain

"""Tables as Parquet, of any size.

Of its two halves, reading and resolving take as long as encoding and writing. So row groups are written by a thread of
their own, while the blocks of the next one come.
"""

from __future__ import annotations

import contextlib
import functools
import itertools
import math
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq

from .._typing import Array
from . import arrow_files, stream
from .arrow_files import UNREADABLE, ArrowFile, extended, joined, opened, why, written
from .by_name import TableError
from .stream import Block, Write, behind

GROUP_BYTES = 1 << 27  # of a row group in memory, where up to two are at a time
_FIRST = 1 << 10  # rows, from which the size of all is told
_WIDTHS = {"INT32": 4, "FLOAT": 4, "INT64": 8, "DOUBLE": 8}  # of a value that stands in no dictionary


class Parquet(ArrowFile):
    """The output has the row groups of the input, compressed and encoded as there; what is too large, in several."""

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

    @contextlib.contextmanager
    def sink(self, path: Path, outputs: dict[str, Array]) -> Iterator[Write]:
        schema = extended(self.schema, outputs)
        groups = map(self._metadata.row_group, range(self._metadata.num_row_groups))
        ends = set(itertools.accumulate(group.num_rows for group in groups))
        coming: list[Any] = []  # of the next row group
        with (
            opened(path, "wb") as file,
            pq.ParquetWriter(file, schema, **self._as_here(outputs)) as writer,
            behind(functools.partial(_write, writer)) as write_behind,
        ):

            def write(block: Block, results: Sequence[Array]) -> None:
                with written(block.start):
                    coming.append(joined(schema, block, results))
                end, n_bytes = block.start + block.n_rows, sum(batch.get_total_buffer_size() for batch in coming)
                if end in ends or n_bytes >= GROUP_BYTES:
                    group = pa.Table.from_batches(coming)
                    coming.clear()
                    write_behind(end - group.num_rows, group)

            yield write

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
            "use_dictionary": [c.path_in_schema for c in columns if _by_dictionary(c)],
            "max_rows_per_page": stream.ROWS,  # or pages end after 20,000, where pyarrow is half as fast as at 1 MiB
        }


def _write(writer: Any, start: int, group: Any) -> None:
    with written(start):
        writer.write_table(group, group.num_rows)


def _by_dictionary(column: Any) -> bool:
    """Whether the values stand in a dictionary. One that saves nothing was given up halfway, and takes long to try."""
    plain = column.num_values * _WIDTHS.get(column.physical_type, math.inf)
    return any("DICTIONARY" in e for e in column.encodings) and column.total_uncompressed_size < plain

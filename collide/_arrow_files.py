"""Tables in the formats of pyarrow: Parquet, Arrow IPC and CSV, of any size."""

from __future__ import annotations

import contextlib
import mmap
import os
import reprlib
from collections import deque
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.csv
import pyarrow.ipc
import pyarrow.parquet as pq

from ._stream import ROWS, Array, Block, Source, Write
from ._tables import Columns, TableError
from .arrow import no_rows, to_numpy

_UNREADABLE = (pa.ArrowException, OSError, EOFError, UnicodeError)
_BLOCK_BYTES = 1 << 24  # where rows are long, a block has fewer of them
_FIRST = 1 << 10  # rows, from which the size of all is told
_TEXT_BYTES = 1 << 21  # of CSV, whose reader holds a dozen blocks: with 8 MiB it took 700 MiB, not 400, and as long


class _Arrow(Source):
    """What the formats share: a block is a record batch, and its results are columns after the others."""

    schema: Any
    _columns: Columns

    def select(self, columns: Columns) -> dict[str, Array]:
        self._columns = columns
        return to_numpy(no_rows(self.schema, columns), columns, 0)

    def blocks(self) -> Iterator[Block]:
        start = 0
        try:
            for batch in self._batches():
                yield Block(start, batch.num_rows, self._numbers(batch, start), batch)
                start += batch.num_rows
        except _UNREADABLE as error:
            raise TableError(self._located(error, start)) from None

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
            except _UNREADABLE as again:
                return f"column {name}: row {row}: cannot be read ({_why(again)})"
        return f"row {start}: cannot be read ({_why(error)})"

    def _column(self, name: str) -> Iterator[Any]:
        """The batches of one column only."""
        raise NotImplementedError


def _why(error: BaseException) -> str:
    return " ".join(str(error).split()).removesuffix(".")


def _local(path: Path) -> str:
    """A name that pyarrow takes for no address of something else."""
    return os.fsencode(path.absolute()).decode()


def _joined(block: Block, schema: Any, results: Sequence[Array]) -> Any:
    """The batch with its results, under the schema of both."""
    try:
        columns = [_compact(column) for column in block.rest.columns]
        return pa.RecordBatch.from_arrays([*columns, *map(pa.array, results)], schema=schema)
    except pa.ArrowException as error:  # damage that shows only here
        raise TableError(f"row {block.start}: cannot be read ({_why(error)})") from None


def _compact(column: Any) -> Any:
    """Without what lies beyond a slice: of views, each slice would be written with the data of all."""
    kind = column.type
    if pa.types.is_string_view(kind):
        return column.cast(pa.large_string()).cast(kind)
    if pa.types.is_binary_view(kind):
        return column.cast(pa.large_binary()).cast(kind)
    return column


def _extended(schema: Any, outputs: dict[str, Array]) -> Any:
    for name, u in outputs.items():
        schema = schema.append(pa.field(name, pa.from_numpy_dtype(u.dtype)))
    return schema


class Parquet(_Arrow):
    """The output is compressed and encoded as the input is. Each block is a row group."""

    def __init__(self, path: Path) -> None:
        try:
            name = _local(path)
            self._metadata = pq.read_metadata(name)
            # Buffered, or a column of a whole row group would be read at once, and be in memory as it lies in the file.
            each = max(1 << 14, _BLOCK_BYTES // max(1, self._metadata.num_columns))
            self._file = pq.ParquetFile(name, metadata=self._metadata, buffer_size=each, pre_buffer=False)
            self.schema = self._file.schema_arrow
            self.names, self.n_rows = list(self.schema.names), self._metadata.num_rows
        except _UNREADABLE as error:
            raise TableError(f"cannot be read as Parquet ({_why(error)})") from None

    def _batches(self, **options: Any) -> Iterator[Any]:
        for g in range(self._metadata.num_row_groups):
            yield from self._file.iter_batches(self._n_rows_of(g), row_groups=[g], **options)

    def _n_rows_of(self, g: int) -> int:
        """Of a block of this row group, by its first rows as they are in memory, and by all of it as it is stored."""
        group = self._metadata.row_group(g)
        first = next(self._file.iter_batches(_FIRST, row_groups=[g]), None)
        if first is None:
            return ROWS
        longest = max(first.get_total_buffer_size() / first.num_rows, group.total_byte_size / group.num_rows)
        return max(1, min(ROWS, int(_BLOCK_BYTES / longest)))

    def _column(self, name: str) -> Iterator[Any]:
        for g in range(self._metadata.num_row_groups):
            yield from self._file.iter_batches(_FIRST, row_groups=[g], columns=[name])

    @contextlib.contextmanager
    def sink(self, path: Path, outputs: dict[str, Array]) -> Iterator[Write]:
        schema = _extended(self.schema, outputs)
        with pq.ParquetWriter(_local(path), schema, **self._as_here(outputs)) as writer:
            yield lambda block, after: writer.write_batch(_joined(block, schema, after))

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


class Ipc(_Arrow):
    """Arrow's file format, mapped: what is not compressed is not copied. A batch that is has to fit into memory.

    The output is not compressed: pyarrow does not tell how the input is.
    """

    _open_any, _new_any = staticmethod(pa.ipc.open_file), staticmethod(pa.ipc.new_file)

    def __init__(self, path: Path) -> None:
        try:
            with path.open("rb") as file:
                self._map = mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ)
            self._reader = self._open()
            self.schema = self._reader.schema
            self.names, self.n_rows = list(self.schema.names), None
        except (*_UNREADABLE, ValueError) as error:
            raise TableError(f"cannot be read as Arrow IPC ({_why(error)})") from None

    def _open(self, **options: Any) -> Any:
        return self._open_any(pa.py_buffer(self._map), options=pa.ipc.IpcReadOptions(**options))

    def _all(self, reader: Any) -> Iterator[Any]:
        return (reader.get_batch(b) for b in range(reader.num_record_batches))

    def _batches(self) -> Iterator[Any]:
        n_read = 0
        for b, batch in enumerate(self._all(self._reader)):
            batch.validate()
            n_read += batch.num_rows
            self._guess(n_read, b + 1)
            rows = max(1, min(ROWS, int(_BLOCK_BYTES * batch.num_rows / max(1, batch.get_total_buffer_size()))))
            for start in range(0, batch.num_rows, rows):
                yield batch.slice(start, rows)

    def _guess(self, n_rows: int, n_batches: int) -> None:
        self.n_rows = n_rows * self._reader.num_record_batches // n_batches

    def _column(self, name: str) -> Iterator[Any]:
        return self._all(self._open(included_fields=[self.names.index(name)]))

    @contextlib.contextmanager
    def sink(self, path: Path, outputs: dict[str, Array]) -> Iterator[Write]:
        schema = _extended(self.schema, outputs)

        def write(block: Block, after: Sequence[Array]) -> None:
            writer.write_batch(_joined(block, schema, after))
            self._map.madvise(mmap.MADV_DONTNEED)  # or the file's pages would count as memory of this process

        with pa.OSFile(_local(path), "wb") as file, self._new_any(file, schema) as writer:
            yield write


class IpcStream(Ipc):
    """Arrow's format for streams, which does not say how many batches there are."""

    _open_any, _new_any = staticmethod(pa.ipc.open_stream), staticmethod(pa.ipc.new_stream)

    def _all(self, reader: Any) -> Iterator[Any]:
        return iter(reader)

    def _guess(self, n_rows: int, n_batches: int) -> None:
        pass


# Marks that a value may hold only within quotes.
_MARKS = b'",\r\n'


class Csv(_Arrow):
    """Comma-separated values in UTF-8 below a line of names. What stands there is kept as it stands, as text."""

    def __init__(self, path: Path) -> None:
        self.names, self.n_rows, self._path = [], None, ""
        try:
            self._path = _local(path)
            self.names = list(self._open(pa.OSFile(self._path)).schema.names)
        except _UNREADABLE as error:
            raise TableError(self._located(error, 0)) from None

    def _open(self, file: Any, use_threads: bool = True) -> Any:
        return pa.csv.open_csv(
            file,
            pa.csv.ReadOptions(use_threads=use_threads, block_size=_TEXT_BYTES),
            pa.csv.ParseOptions(newlines_in_values=True),
            pa.csv.ConvertOptions(column_types=dict.fromkeys(self.names, pa.string())),
        )

    def _batches(self) -> Iterator[Any]:
        file, n_read = pa.OSFile(self._path), 0
        for batch in self._open(file):
            n_read += batch.num_rows
            self.n_rows = n_read * file.size() // max(1, file.tell())  # a guess, from the rows so far
            yield batch

    def _located(self, error: BaseException, start: int) -> str:
        """On one thread the reader counts lines, and names the one that is at fault."""
        try:
            deque(self._open(pa.OSFile(self._path), use_threads=False), maxlen=0)
        except _UNREADABLE as again:
            error = again
        if "straddling" in str(error):
            return f"after row {start}: a line of more than {_TEXT_BYTES:,} bytes, or a quote that is not closed"
        return f"cannot be read as CSV ({_why(error)})"

    def select(self, columns: Columns) -> dict[str, Array]:
        self._columns = columns
        return {argument: np.empty(0) for argument in columns.inputs}

    def _numbers(self, batch: Any, start: int) -> dict[str, Array]:
        arrays = {}
        for argument, name in self._columns.inputs.items():
            text = pc.utf8_trim_whitespace(batch.column(name))
            try:
                arrays[argument] = pc.cast(text, pa.float64()).to_numpy(zero_copy_only=False)
            except pa.ArrowInvalid:
                row, value = next((k, v) for k, v in enumerate(text.to_pylist()) if not _is_number(v))
                wrong = f"{reprlib.repr(value)} is no number" if value else "there is no number"
                raise TableError(f"column {name}: row {start + row}: {wrong}") from None
        return arrays

    @contextlib.contextmanager
    def sink(self, path: Path, outputs: dict[str, Array]) -> Iterator[Write]:
        with path.open("wb") as file:
            names = [pa.array([name]) for name in (*self.names, *outputs)]
            file.write(_lines(names))
            yield lambda block, after: file.write(_lines([*block.rest.columns, *(_text(u) for u in after)]))


def _is_number(text: str) -> bool:
    try:
        pc.cast(pa.scalar(text), pa.float64())
    except pa.ArrowInvalid:
        return False
    return True


def _text(values: Array) -> Any:
    """The shortest that gives the same number when it is read."""
    return pc.cast(pa.array(values), pa.string())


def _lines(columns: Sequence[Any]) -> Any:
    """Lines of values, quoted where they need it: pyarrow's own writer quotes all texts, or none."""
    rows = pc.binary_join_element_wise(*map(_quoted, columns), ",")
    return pc.binary_join_element_wise(rows, "", "\n").buffers()[2] or b""


def _quoted(text: Any) -> Any:
    values = bytes(text.buffers()[2] or b"")
    if not any(mark in values for mark in _MARKS):
        return text
    quoted = pc.binary_join_element_wise('"', pc.replace_substring(text, '"', '""'), '"', "")
    return pc.if_else(pc.match_substring_regex(text, '[",\r\n]'), quoted, text)

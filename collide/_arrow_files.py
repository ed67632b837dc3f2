"""Tables in the formats of pyarrow: Parquet, Arrow IPC and CSV, of any size."""

from __future__ import annotations

import contextlib
import mmap
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
from .arrow import to_numpy

_UNREADABLE = (pa.ArrowException, OSError, EOFError)
_BLOCK_BYTES = 1 << 24  # where rows are long, a block has fewer of them
_TEXT_BYTES = 1 << 21  # of CSV, whose reader holds a dozen blocks: with 8 MiB it took 700 MiB, not 400, and as long


class _Arrow(Source):
    """What the formats share: a block is a record batch, and its results are columns after the others."""

    schema: Any
    _columns: Columns

    @property
    def names(self) -> list[str]:  # type: ignore[override]
        return self.schema.names  # type: ignore[no-any-return]

    def select(self, columns: Columns) -> dict[str, Array]:
        self._columns = columns
        return to_numpy(self.schema.empty_table(), columns, 0)

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


def _joined(batch: Any, outputs: Any, results: Sequence[Array]) -> Any:
    """The batch with its results, under the schema of both."""
    return pa.RecordBatch.from_arrays([*batch.columns, *map(pa.array, results)], schema=outputs)


def _extended(schema: Any, outputs: dict[str, Array]) -> Any:
    for name, u in outputs.items():
        schema = schema.append(pa.field(name, pa.from_numpy_dtype(u.dtype)))
    return schema


class Parquet(_Arrow):
    """The output is compressed and encoded as the input is. Each block is a row group."""

    def __init__(self, path: Path) -> None:
        try:
            # Buffered, or a column of a whole row group would be read at once, and be in memory as it lies in the file.
            self._file = pq.ParquetFile(path, buffer_size=1 << 20, pre_buffer=False)
            self.schema = self._file.schema_arrow
        except _UNREADABLE as error:
            raise TableError(f"cannot be read as Parquet ({_why(error)})") from None
        self._metadata = self._file.metadata
        self.n_rows = self._metadata.num_rows
        groups = [self._metadata.row_group(g) for g in range(self._metadata.num_row_groups)]
        row_bytes = sum(group.total_byte_size for group in groups) / max(1, self.n_rows)
        longest = max((group.num_rows for group in groups), default=1)
        self._block = max(1, min(ROWS, longest, int(_BLOCK_BYTES / max(1.0, row_bytes))))

    def _batches(self) -> Iterator[Any]:
        return self._file.iter_batches(self._block)  # type: ignore[no-any-return]

    def _column(self, name: str) -> Iterator[Any]:
        return self._file.iter_batches(self._block, columns=[name])  # type: ignore[no-any-return]

    @contextlib.contextmanager
    def sink(self, path: Path, outputs: dict[str, Array]) -> Iterator[Write]:
        schema = _extended(self.schema, outputs)
        with pq.ParquetWriter(path, schema, **self._as_here(outputs)) as writer:
            yield lambda block, after: writer.write_batch(_joined(block.rest, schema, after))

    def _as_here(self, outputs: dict[str, Array]) -> dict[str, Any]:
        if not self._metadata.num_row_groups:
            return {}
        group = self._metadata.row_group(0)
        columns = [group.column(c) for c in range(group.num_columns)]
        codecs = {c.path_in_schema: c.compression.replace("UNCOMPRESSED", "NONE") for c in columns}
        usual = codecs[self._columns.inputs["m1"]]
        return {
            "compression": {**codecs, **dict.fromkeys(outputs, usual)},
            "use_dictionary": [c.path_in_schema for c in columns if any("DICTIONARY" in e for e in c.encodings)],
        }


class Ipc(_Arrow):
    """Arrow's file format, or that for streams, mapped: what is not compressed is not copied."""

    def __init__(self, path: Path) -> None:
        try:
            with path.open("rb") as file:
                self._map = mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ)
            self._is_file = self._map[:6] == b"ARROW1"
            self._reader = self._open()
            self.schema = self._reader.schema
        except (*_UNREADABLE, ValueError) as error:
            raise TableError(f"cannot be read as Arrow IPC ({_why(error)})") from None
        self.n_rows = None

    def _open(self, **options: Any) -> Any:
        opened = pa.ipc.open_file if self._is_file else pa.ipc.open_stream
        return opened(pa.py_buffer(self._map), options=pa.ipc.IpcReadOptions(**options))

    def _all(self, reader: Any) -> Iterator[Any]:
        if not self._is_file:
            return iter(reader)
        return (reader.get_batch(b) for b in range(reader.num_record_batches))

    def _batches(self) -> Iterator[Any]:
        n_read = 0
        for b, batch in enumerate(self._all(self._reader)):
            n_read += batch.num_rows
            if self._is_file:
                self.n_rows = n_read * self._reader.num_record_batches // (b + 1)  # a guess, until the last one
            rows = max(1, min(ROWS, int(_BLOCK_BYTES * batch.num_rows / max(1, batch.nbytes))))
            for start in range(0, batch.num_rows, rows):
                yield batch.slice(start, rows)

    def _column(self, name: str) -> Iterator[Any]:
        return self._all(self._open(included_fields=[self.schema.names.index(name)]))

    @contextlib.contextmanager
    def sink(self, path: Path, outputs: dict[str, Array]) -> Iterator[Write]:
        schema = _extended(self.schema, outputs)
        opened = pa.ipc.new_file if self._is_file else pa.ipc.new_stream

        def write(block: Block, after: Sequence[Array]) -> None:
            writer.write_batch(_joined(block.rest, schema, after))
            self._map.madvise(mmap.MADV_DONTNEED)  # or the file's pages would count as memory of this process

        with pa.OSFile(str(path), "wb") as file, opened(file, schema) as writer:
            yield write


# Marks that a value may hold only within quotes.
_MARKS = b'",\r\n'


class Csv(_Arrow):
    """Comma-separated values in UTF-8 below a line of names. What stands there is kept as it stands, as text."""

    def __init__(self, path: Path) -> None:
        self._path, self.n_rows = str(path), None
        try:
            names = self._open(pa.OSFile(self._path), {}).schema.names
        except _UNREADABLE as error:
            raise TableError(self._located(error, 0)) from None
        self.schema = pa.schema([(name, pa.string()) for name in names])

    def _open(self, file: Any, types: dict[str, Any], use_threads: bool = True) -> Any:
        return pa.csv.open_csv(
            file,
            pa.csv.ReadOptions(use_threads=use_threads, block_size=_TEXT_BYTES),
            pa.csv.ParseOptions(newlines_in_values=True),
            pa.csv.ConvertOptions(column_types=types),
        )

    def _batches(self) -> Iterator[Any]:
        file, n_read = pa.OSFile(self._path), 0
        for batch in self._open(file, dict.fromkeys(self.names, pa.string())):
            n_read += batch.num_rows
            self.n_rows = n_read * file.size() // max(1, file.tell())  # a guess, from the rows so far
            yield batch

    def _located(self, error: BaseException, start: int) -> str:
        """On one thread the reader counts lines, and names the one that is at fault."""
        try:
            deque(self._open(pa.OSFile(self._path), {}, use_threads=False), maxlen=0)
        except _UNREADABLE as again:
            error = again
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
                wrong = f"{value!r} is no number" if value else "there is no number"
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

"""Tables as comma-separated values, of any size; also with another mark between them, and compressed by gzip."""

from __future__ import annotations

import contextlib
import csv
import gzip
import io
import os
import re
import reprlib
import zlib
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any, BinaryIO, TextIO, cast

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.csv

from .._typing import Array
from .arrow_batches import from_numpy
from .arrow_files import UNREADABLE, ArrowFile, opened, why
from .by_name import Columns, TableError, cannot_hold
from .standard import Input, Place, created
from .stream import ArrowTable, Block, Sink, Source, Write

_TEXT_BYTES = 1 << 21  # whose reader holds a dozen blocks: with 8 MiB it took 700 MiB, not 400, and as long
_MARKS = '",\r\n'  # that a value may hold only within quotes; instead of the comma, what parts the values
_BOM = b"\xef\xbb\xbf"
_LEVEL = 6  # of compression, as the command gzip has it; at 9, which is Python's, it takes three times as long


class Csv(ArrowFile):
    """Values in UTF-8 below a line of names, all of them text, which a sink of the same kind keeps as it stands."""

    def __init__(self, place: Path | Input, delimiter: str = ",", compressed: bool = False) -> None:
        super().__init__(place)
        self._delimiter, self._compressed = delimiter, compressed
        self._all: bytes | None = None  # of little text
        self.names, self.n_rows = [], None
        try:
            first = self._first()
            if len(first) <= _TEXT_BYTES:
                self._all = first
            # Not by a reader of blocks, which reads ahead: where the process ends meanwhile, it aborts now and then.
            top = pa.BufferReader(_ended(self._top(first)))
            self.names = list(pa.csv.read_csv(top, *self._options(use_threads=False)).column_names)
        except UNREADABLE as error:
            raise self._located(error, 0) from None

    def _first(self) -> bytes:
        """The beginning, in which the names stand; one byte more than of a block, if there is more."""
        if isinstance(self._place, Input):
            return self._place.peek(_TEXT_BYTES + 1)
        with self._stream() as text:
            return bytes(text.read(_TEXT_BYTES + 1))

    def _top(self, text: bytes) -> bytes:
        """The line of names, which may be several, as a name within quotes may have several."""
        text = text.removeprefix(_BOM)
        lines = io.StringIO(text.decode("latin-1"), newline="")  # a character a byte
        with contextlib.suppress(csv.Error):
            next(filter(None, csv.reader(lines, delimiter=self._delimiter)), None)
            return text[: lines.tell()]
        return text

    def _stream(self) -> Any:
        """All of it, as it is read from a file or standard input."""
        if isinstance(self._place, Input):
            return self._file
        self._raw = opened(self._place)
        if not os.path.sameopenfile(self._raw.fileno(), self._file.fileno()):
            raise TableError("has been replaced by another file while it was read")
        return pa.CompressedInputStream(self._raw, "gzip") if self._compressed else self._raw

    def _text(self) -> Any:
        """All of it, for one reader: they read ahead."""
        return self._stream() if self._all is None else pa.BufferReader(_ended(self._all))

    def _open(self, text: Any, use_threads: bool = True) -> Any:
        return pa.csv.open_csv(text, *self._options(use_threads))

    def _options(self, use_threads: bool) -> tuple[Any, Any, Any]:
        return (
            pa.csv.ReadOptions(use_threads=use_threads, block_size=_TEXT_BYTES),
            pa.csv.ParseOptions(delimiter=self._delimiter, newlines_in_values=True),
            pa.csv.ConvertOptions(column_types=dict.fromkeys(self.names, pa.string())),
        )

    def _batches(self) -> Iterator[Any]:
        text, n_read = self._text(), 0
        for batch in self._open(text):
            n_read += batch.num_rows
            self.n_rows = self._guess(n_read, text)
            if batch.schema.names != self.names:
                raise TableError(f"row {n_read - batch.num_rows}: the file has changed while it was read")
            yield batch

    def _guess(self, n_read: int, text: Any) -> int | None:
        """How many rows there are, from how far these reach."""
        if self._all is not None:
            return n_read * int(text.size()) // max(1, int(text.tell()))
        return None if self._size is None else n_read * self._size // max(1, self._raw.tell())

    def _located(self, error: BaseException, start: int) -> TableError:
        """On one thread the reader counts lines, and names the one that is at fault."""
        if self._size is not None:
            try:
                self._unpack()
                deque(self._open(self._text(), use_threads=False), maxlen=0)
            except UNREADABLE as again:
                error = again
        if "straddling" in str(error):
            long = f"a line of more than {_TEXT_BYTES:,} bytes, or a quote that is not closed"
            return TableError(f"after row {start}: {long}")
        if "ompressed stream" in str(error) or "zlib" in str(error):
            return TableError(f"after row {start}: cannot be unpacked: it is cut off, or damaged ({why(error)})")
        found = re.search(r"Row #(\d+)", str(error))  # of all that are no empty lines; the names are the first
        return TableError(f"cannot be read as CSV ({why(error)})", int(found[1]) - 2 if found else None)

    def _unpack(self) -> None:
        """All that is compressed: what is damaged may be no table either, and a reader that reads ahead says either."""
        if self._compressed:
            with self._stream() as text:
                while text.read(_TEXT_BYTES):
                    pass

    def place_of(self, row: int) -> str:
        """Its line. Only if somebody asks, lines are counted: they may be empty, or be part of a value in quotes."""
        if isinstance(self._place, Input):
            return ""
        with contextlib.suppress(OSError, EOFError, zlib.error, csv.Error), self._lines(self._place) as lines:
            reader, n_records, before = csv.reader(lines, delimiter=self._delimiter), -2, 0
            for record in reader:
                n_records += bool(record)
                if n_records == row:
                    return f" (line {before + 1})"
                before = reader.line_num
        return ""

    def _lines(self, path: Path) -> TextIO:
        text = gzip.open(path) if self._compressed else path.open("rb")  # noqa: SIM115  # closed with what is around it
        return io.TextIOWrapper(cast(BinaryIO, text), "utf-8-sig", "replace", newline="")

    def select(self, columns: Columns) -> dict[str, Array]:
        self._columns = columns
        return {argument: np.empty(0) for argument in columns.inputs}

    def as_arrow(self, target: str) -> ArrowTable:
        """The argument columns as numbers."""
        arguments = {name: argument for argument, name in self._columns.inputs.items()}
        types = [(name, pa.float64() if name in arguments else pa.string()) for name in self.names]
        schema = pa.schema(types)

        def of(block: Block) -> Any:
            texts = zip(self.names, block.table.columns, strict=True)
            columns = [from_numpy(block.arrays[arguments[n]]) if n in arguments else text for n, text in texts]
            return pa.RecordBatch.from_arrays(columns, schema=schema)

        return ArrowTable(schema, of)

    def _numbers(self, batch: Any, start: int) -> dict[str, Array]:
        arrays = {}
        for argument, name in self._columns.inputs.items():
            text = pc.utf8_trim_whitespace(batch.column(name))
            try:
                arrays[argument] = values = pc.cast(text, pa.float64()).to_numpy(zero_copy_only=False)
            except pa.ArrowInvalid:
                row, value = next((k, v) for k, v in enumerate(text.to_pylist()) if not _is_number(v))
                raise TableError(f"column {name}: row {start + row}: {_what_is_wrong(value)}", start + row) from None
            self._check_infinite(name, text, values, start)
        return arrays

    def _check_infinite(self, name: str, text: Any, values: Array, start: int) -> None:
        """A number too large for a float64 is read as inf, which is a wall. Who means that writes no digits."""
        (rows,) = np.nonzero(np.isinf(values))
        for row in rows[pc.match_substring_regex(text.take(rows), "[0-9]").to_numpy(zero_copy_only=False)][:1]:
            value, row = reprlib.repr(text[row].as_py()), start + int(row)
            raise TableError(f"column {name}: row {row}: {value} is beyond the largest number, 1.8e308", row)


def _ended(text: bytes) -> bytes:
    """pyarrow wants the line of names to end, where there is no other."""
    return text if text.endswith(b"\n") or not text else text + b"\n"


def _is_number(text: str) -> bool:
    try:
        pc.cast(pa.scalar(text), pa.float64())
    except pa.ArrowInvalid:
        return False
    return True


def _what_is_wrong(value: str) -> str:
    if re.fullmatch(r"[-+]?\d*,\d+([eE][-+]?\d+)?", value):
        return f"{reprlib.repr(value)} is no number: decimal commas are not taken, write {value.replace(',', '.')}"
    return f"{reprlib.repr(value)} is no number" if value else "there is no number"


class CsvSink(Sink):
    """The texts of a CSV source as they stand, and anything else as the shortest text that is read as the same."""

    def __init__(
        self, source: Source, outputs: dict[str, Array], delimiter: str = ",", compressed: bool = False
    ) -> None:
        self._names = [*source.names, *outputs]
        self._delimiter, self._compressed = delimiter, compressed
        self._texts: Callable[[Block], Sequence[Any]]
        if isinstance(source, Csv):
            self._texts = lambda block: block.table.columns
            return
        schema, of = source.as_arrow("CSV text")
        for field in schema:
            try:
                _as_text(pa.nulls(0, field.type))
            except pa.ArrowException:
                raise cannot_hold(field.name, f"has type {field.type}", "CSV text") from None
        self._texts = lambda block: [*map(_foreign, of(block).columns, schema.names, [block.start] * len(schema))]

    @contextlib.contextmanager
    def open(self, place: Place) -> Iterator[Write]:
        with created(place) as file, self._packed(file) as text:
            self._write(text, [pa.array([name]) for name in self._names])

            def write(block: Block, results: Sequence[Array]) -> None:
                numbers = [_as_text(from_numpy(np.atleast_1d(u))) for u in results]
                self._write(text, [*self._texts(block), *numbers])

            yield write

    def _packed(self, file: BinaryIO) -> contextlib.AbstractContextManager[BinaryIO]:
        """Neither with the name of the file, which is temporary, nor with the time: the same bytes each time."""
        if not self._compressed:
            return contextlib.nullcontext(file)
        return cast(BinaryIO, gzip.GzipFile("", "wb", _LEVEL, file, mtime=0))

    def _write(self, file: BinaryIO, columns: Sequence[Any]) -> None:
        """Lines of values, quoted where they need it: pyarrow's own writer quotes all texts, or none."""
        rows = pc.binary_join_element_wise(*map(self._quoted, columns), self._delimiter)
        file.write(pc.binary_join_element_wise(rows, "", "\n").buffers()[2] or b"")

    def _quoted(self, text: Any) -> Any:
        marks = _MARKS.replace(",", self._delimiter)
        values = bytes(text.buffers()[2] or b"")
        if not any(mark.encode() in values for mark in marks):
            return text
        quoted = pc.binary_join_element_wise('"', pc.replace_substring(text, '"', '""'), '"', "")
        any_mark = "|".join(f"\\x{ord(mark):02x}" for mark in marks)
        return pc.if_else(pc.match_substring_regex(text, any_mark), quoted, text)


def _as_text(column: Any) -> Any:
    kind = column.type
    if pa.types.is_dictionary(kind):
        return _as_text(column.dictionary_decode())
    if pa.types.is_boolean(kind):  # which counts as a number, 1 or 0, and is read as one
        column = column.cast(pa.uint8())
    return pc.cast(column, pa.string())


def _foreign(column: Any, name: str, start: int) -> Any:
    """The texts of what is in a column; no value is no text."""
    try:
        text = pc.fill_null(_as_text(column), "")
        if pa.types.is_temporal(column.type):  # what no calendar has is no text either, but a remark of pyarrow's
            beyond = pc.index(pc.starts_with(text, "<value out of range"), True).as_py()
            if beyond >= 0:
                row = start + beyond
                raise TableError(
                    f"column {name}: row {row}: is a time that CSV text cannot hold: choose another format", row
                )
        return text
    except pa.ArrowInvalid as error:
        where = f"column {name}: rows {start} to {start + len(column) - 1}"
        raise TableError(f"{where}: cannot be written as CSV text ({why(error)})") from None

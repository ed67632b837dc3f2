"""Tables as comma-separated values, of any size."""

from __future__ import annotations

import contextlib
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

from .._typing import Array
from .arrow_files import UNREADABLE, ArrowFile, opened, why
from .by_name import Columns, TableError
from .stream import Write

_TEXT_BYTES = 1 << 21  # whose reader holds a dozen blocks: with 8 MiB it took 700 MiB, not 400, and as long
# Marks that a value may hold only within quotes.
_MARKS = b'",\r\n'


class Csv(ArrowFile):
    """Comma-separated values in UTF-8 below a line of names. What stands there is kept as it stands, as text."""

    def __init__(self, path: Path) -> None:
        super().__init__(path)
        self.names, self.n_rows, self._path = [], None, path
        try:
            self.names = list(self._open(self._text()).schema.names)
        except UNREADABLE as error:
            raise TableError(self._located(error, 0)) from None

    def _text(self) -> Any:
        """All of it, for one reader: they read ahead."""
        if self._size > _TEXT_BYTES:
            text = opened(self._path, "rb")
            if not os.path.sameopenfile(text.fileno(), self._file.fileno()):
                raise TableError("has been replaced by another file while it was read")
            return text
        text = self._file.read_at(self._size, 0)
        # pyarrow wants the line of names to end, where there is no other.
        return pa.BufferReader(text if text.endswith(b"\n") or not text else text + b"\n")

    def _open(self, text: Any, use_threads: bool = True) -> Any:
        return pa.csv.open_csv(
            text,
            pa.csv.ReadOptions(use_threads=use_threads, block_size=_TEXT_BYTES),
            pa.csv.ParseOptions(newlines_in_values=True),
            pa.csv.ConvertOptions(column_types=dict.fromkeys(self.names, pa.string())),
        )

    def _batches(self) -> Iterator[Any]:
        text, n_read = self._text(), 0
        for batch in self._open(text):
            n_read += batch.num_rows
            self.n_rows = n_read * self._size // max(1, text.tell())  # a guess, from the rows so far
            if batch.schema.names != self.names:
                raise TableError(f"row {n_read - batch.num_rows}: the file has changed while it was read")
            yield batch

    def _located(self, error: BaseException, start: int) -> str:
        """On one thread the reader counts lines, and names the one that is at fault."""
        try:
            deque(self._open(self._text(), use_threads=False), maxlen=0)
        except UNREADABLE as again:
            error = again
        if "straddling" in str(error):
            return f"after row {start}: a line of more than {_TEXT_BYTES:,} bytes, or a quote that is not closed"
        return f"cannot be read as CSV ({why(error)})"

    def select(self, columns: Columns) -> dict[str, Array]:
        self._columns = columns
        return {argument: np.empty(0) for argument in columns.inputs}

    def _numbers(self, batch: Any, start: int) -> dict[str, Array]:
        arrays = {}
        for argument, name in self._columns.inputs.items():
            text = pc.utf8_trim_whitespace(batch.column(name))
            try:
                arrays[argument] = values = pc.cast(text, pa.float64()).to_numpy(zero_copy_only=False)
                self._check_infinite(name, text, values, start)
            except pa.ArrowInvalid:
                row, value = next((k, v) for k, v in enumerate(text.to_pylist()) if not _is_number(v))
                wrong = f"{reprlib.repr(value)} is no number" if value else "there is no number"
                raise TableError(f"column {name}: row {start + row}: {wrong}") from None
        return arrays

    def _check_infinite(self, name: str, text: Any, values: Array, start: int) -> None:
        """A number too large for a float64 is read as inf, which is a wall. Who means that writes no digits."""
        (rows,) = np.nonzero(np.isinf(values))
        for row in rows[pc.match_substring_regex(text.take(rows), "[0-9]").to_numpy(zero_copy_only=False)][:1]:
            value = reprlib.repr(text[row].as_py())
            raise TableError(f"column {name}: row {start + row}: {value} is beyond the largest number, 1.8e308")

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

"""Tables in Arrow's IPC formats, of any number of batches. Each batch has to fit into memory.

The files are read, not mapped, though then a batch of any size would do: a process whose mapped file another one
truncates is ended (SIGBUS), with no word of what was wrong.
"""

from __future__ import annotations

import contextlib
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.ipc

from .._typing import Array
from . import arrow_files, stream
from .arrow_files import UNREADABLE, ArrowFile, ArrowSink, created, extended, why, written
from .by_name import TableError
from .standard import Input, Place
from .stream import ArrowTable, Block, Source, Write


class Ipc(ArrowFile):
    """Arrow's file format."""

    def __init__(self, place: Path | Input) -> None:
        super().__init__(place)
        try:
            self.schema = self._open().schema
            self.names, self.n_rows = list(self.schema.names), None
        except UNREADABLE as error:
            raise TableError(f"cannot be read as Arrow IPC ({why(error)})") from None

    def _open(self, **options: Any) -> Any:
        self._file.seek(0)
        return pa.ipc.open_file(self._file, options=pa.ipc.IpcReadOptions(**options))

    def _all(self, reader: Any) -> Iterator[Any]:
        n_rows = 0
        for b in range(reader.num_record_batches):
            batch = reader.get_batch(b)
            n_rows += batch.num_rows
            self.n_rows = n_rows * reader.num_record_batches // (b + 1)  # a guess, from the batches so far
            yield batch

    def _batches(self) -> Iterator[Any]:
        views = any(map(_is_view, self.schema.types))
        for batch in self._all(self._open()):
            batch.validate(full=views)  # a damaged view leads to where nothing is, and is followed when it is written
            most = int(arrow_files.BLOCK_BYTES * batch.num_rows / max(1, batch.get_total_buffer_size()))
            rows = max(1, min(stream.ROWS, most))
            for start in range(0, batch.num_rows, rows):
                yield batch.slice(start, rows)

    def _column(self, name: str) -> Iterator[Any]:
        return self._all(self._open(included_fields=[self.names.index(name)]))


class IpcStream(Ipc):
    """Arrow's format for streams, which does not say how many batches there are."""

    _reader: Any = None  # of standard input, which is read once

    def _open(self, **options: Any) -> Any:
        if self._size is not None:
            self._file.seek(0)
        elif self._reader:
            return self._reader
        self._reader = pa.ipc.open_stream(self._file, options=pa.ipc.IpcReadOptions(**options))
        return self._reader

    def _all(self, reader: Any) -> Iterator[Any]:
        yield from reader
        if self._file.read(1):
            raise TableError("after the end of the stream there is more, which may be another one: give one at a time")


class IpcSink(ArrowSink):
    """Not compressed: of an input of the same format, pyarrow does not tell how it is.

    A file may not have several dictionaries, but what comes to the first. So what others have in dictionaries, which
    may be of all kinds, is written as what it stands for.
    """

    _new, _target, _is_stream = staticmethod(pa.ipc.new_file), "an .arrow file", False

    def __init__(self, source: Source, outputs: dict[str, Array]) -> None:
        super().__init__(source, outputs, self._target)
        if not (self._is_stream or type(source) is Ipc):
            self._table = _without_dictionaries(self._table)
            self._schema = extended(self._table.schema, outputs)

    @contextlib.contextmanager
    def open(self, place: Place) -> Iterator[Write]:
        options = pa.ipc.IpcWriteOptions(emit_dictionary_deltas=True)
        with created(place) as file, self._new(file, self._schema, options=options) as writer:

            def write(block: Block, results: Sequence[Array]) -> None:
                with written(block.start):
                    writer.write_batch(self._joined(block, results))

            yield write


class IpcStreamSink(IpcSink):
    """Arrow's format for streams."""

    _new, _target, _is_stream = staticmethod(pa.ipc.new_stream), "an .arrows stream", True


def _without_dictionaries(table: ArrowTable) -> ArrowTable:
    fields = [f.with_type(f.type.value_type) if pa.types.is_dictionary(f.type) else f for f in table.schema]
    schema = pa.schema(fields, table.schema.metadata)

    def of(block: Block) -> Any:
        columns = [c.dictionary_decode() if pa.types.is_dictionary(c.type) else c for c in table.of(block).columns]
        return pa.RecordBatch.from_arrays(columns, schema=schema)

    return ArrowTable(schema, of)


def _is_view(kind: Any) -> bool:
    return bool(pa.types.is_string_view(kind) or pa.types.is_binary_view(kind))

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
from .arrow_files import UNREADABLE, ArrowFile, extended, joined, opened, why, written
from .by_name import TableError
from .stream import Block, Write


class Ipc(ArrowFile):
    """Arrow's file format. The output is not compressed: pyarrow does not tell how the input is."""

    _open_any, _new_any = staticmethod(pa.ipc.open_file), staticmethod(pa.ipc.new_file)

    def __init__(self, path: Path) -> None:
        super().__init__(path)
        try:
            self.schema = self._open().schema
            self.names, self.n_rows = list(self.schema.names), None
        except UNREADABLE as error:
            raise TableError(f"cannot be read as Arrow IPC ({why(error)})") from None

    def _open(self, **options: Any) -> Any:
        self._file.seek(0)
        return self._open_any(self._file, options=pa.ipc.IpcReadOptions(**options))

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

    @contextlib.contextmanager
    def sink(self, path: Path, outputs: dict[str, Array]) -> Iterator[Write]:
        schema = extended(self.schema, outputs)
        # A file may not have several dictionaries, but what comes to the first.
        options = pa.ipc.IpcWriteOptions(emit_dictionary_deltas=True)
        with opened(path, "wb") as file, self._new_any(file, schema, options=options) as writer:

            def write(block: Block, results: Sequence[Array]) -> None:
                with written(block.start):
                    writer.write_batch(joined(schema, block, results))

            yield write


class IpcStream(Ipc):
    """Arrow's format for streams, which does not say how many batches there are."""

    _open_any, _new_any = staticmethod(pa.ipc.open_stream), staticmethod(pa.ipc.new_stream)

    def _all(self, reader: Any) -> Iterator[Any]:
        return iter(reader)


def _is_view(kind: Any) -> bool:
    return bool(pa.types.is_string_view(kind) or pa.types.is_binary_view(kind))

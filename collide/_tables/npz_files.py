"""Tables as .npz files, in memory as a whole."""

from __future__ import annotations

import contextlib
import functools
import zipfile
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import IO, Any

import numpy as np

from .._system.messages import reason
from .._typing import Array
from .by_name import Columns, TableError
from .numpy_files import UNREADABLE, NumpySource, is_by_rows, n_rows_of, rows_of_a_block, why
from .standard import Place, created
from .stream import ArrowTable, Block, NumpyTable, Sink, Source, Whole, Write


class Archive(NumpySource):
    """An .npz file: one block, unless Arrow takes it, with columns of any shape beside those of the arguments."""

    _at_once: int | None = None  # rows of a block

    def __init__(self, path: Path) -> None:
        name = ""
        try:
            file = path.open("rb")
        except OSError as error:
            raise TableError(f"cannot be read ({reason(error)})") from None
        try:
            with file:
                archive = np.load(file, allow_pickle=False)
                if not isinstance(archive, np.lib.npyio.NpzFile):
                    raise TableError("is no .npz file")
                self._table: dict[str, Array] = {}
                for name in archive.files:
                    if name in self._table:
                        raise ValueError("there are two of that name")
                    self._table[name] = archive[name]
                    if not isinstance(self._table[name], np.ndarray):
                        raise ValueError("not an array")
        except TableError:
            raise
        except UNREADABLE as error:
            column = f"column {name}: " if name else ""
            raise TableError(f"{column}cannot be read as a .npz file of plain arrays ({why(error)})") from None
        self.names, self.n_rows = list(self._table), None

    def select(self, columns: Columns) -> dict[str, Array]:
        self._columns = {argument: self._table[name] for argument, name in columns.inputs.items()}
        self.n_rows = n_rows_of(columns, self._columns)
        return {argument: column[:0] if column.ndim else column for argument, column in self._columns.items()}

    def blocks(self) -> Iterator[Block]:
        n_rows = 1 if self.n_rows is None else self.n_rows
        for start in range(0, n_rows, self._at_once or max(1, n_rows)):
            rows = slice(start, min(start + (self._at_once or n_rows), n_rows))
            arrays = {argument: column[rows] if column.ndim else column for argument, column in self._columns.items()}
            yield Block(start, rows.stop - start, arrays, rows)

    def close(self) -> None:
        pass

    def as_numpy(self, target: str) -> NumpyTable:
        rows = {name: column for name, column in self._table.items() if is_by_rows(column, self.n_rows)}
        others = {
            name: Whole(c, functools.partial(np.asarray, c)) for name, c in self._table.items() if name not in rows
        }

        def of(block: Block) -> dict[str, Array]:
            return {name: column[block.table] for name, column in rows.items()}

        return NumpyTable({name: column.dtype for name, column in rows.items()}, others, of)

    def as_arrow(self, target: str) -> ArrowTable:
        # What Arrow makes of all rows at once would be in memory twice.
        self._at_once = rows_of_a_block(column.dtype for column in self._table.values())
        return super().as_arrow(target)


class ArchiveSink(Sink):
    """In memory until its end."""

    def __init__(self, source: Source, outputs: dict[str, Array]) -> None:
        self._names, self._outputs = source.names, outputs
        for name in (*source.names, *outputs):
            if "\0" in name:
                raise TableError(f"column {name!r}: has a NUL in its name, where an .npz file ends it")
        self._table = source.as_numpy("an .npz file")

    @contextlib.contextmanager
    def open(self, place: Place) -> Iterator[Write]:
        pieces: dict[str, list[Array]] = {name: [] for name in (*self._table.rows, *self._outputs)}

        def keep(block: Block, results: Sequence[Array]) -> None:
            for name, piece in (*self._table.of(block).items(), *zip(self._outputs, results, strict=True)):
                pieces[name].append(piece)

        yield keep
        columns: dict[str, Array] = {name: self._table.whole[name].load() for name in self._table.whole}
        for name in self._table.rows:
            columns[name] = _joined(pieces.pop(name), self._table.rows[name])
        results = {name: _joined(pieces.pop(name), u.dtype) for name, u in self._outputs.items()}
        with created(place) as file:
            _write(file, {**{name: columns[name] for name in self._names}, **results})


def _joined(pieces: Sequence[Array], dtype: np.dtype[Any]) -> Array:
    if len(pieces) == 1:
        return pieces[0]
    return np.concatenate([np.empty(0, dtype), *pieces], dtype=dtype if dtype.itemsize else None)


def _write(file: IO[bytes], table: Mapping[str, Any]) -> None:
    """numpy.savez, but for the columns that are named as its own arguments."""
    with zipfile.ZipFile(file, "w", zipfile.ZIP_STORED, allowZip64=True) as archive:
        for name, column in table.items():
            with archive.open(f"{name}.npy", "w", force_zip64=True) as member:
                np.lib.format.write_array(member, np.asanyarray(column), allow_pickle=False)

"""Tables in NumPy's own formats: an .npz file, in memory, and a folder of .npy columns, of any size."""

from __future__ import annotations

import contextlib
import mmap
import shutil
import zipfile
import zlib
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import IO, Any

import numpy as np

from ._stream import ROWS, Array, Block, Source, Write
from ._tables import Columns, ColumnTypeError, TableError

# What zipfile and NumPy raise for damage, encryption, methods unknown to them, pickles and sizes out of reach.
_UNREADABLE = (
    OSError,
    ValueError,
    EOFError,
    KeyError,
    RuntimeError,
    MemoryError,
    zipfile.BadZipFile,
    zlib.error,
)


class Archive(Source):
    """An .npz file. It is one block, with columns of any shape beside those that collide."""

    def __init__(self, path: Path) -> None:
        name = ""
        try:
            with path.open("rb") as file:
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
        except _UNREADABLE as error:
            column = f"column {name}: " if name else ""
            raise TableError(f"{column}cannot be read as a .npz file of plain arrays ({_why(error)})") from None
        self.names, self.n_rows = list(self._table), None

    def select(self, columns: Columns) -> dict[str, Array]:
        self._columns = {argument: self._table[name] for argument, name in columns.inputs.items()}
        self.n_rows = _n_rows(columns, self._columns)
        return {argument: column[:0] if column.ndim else column for argument, column in self._columns.items()}

    def blocks(self) -> Iterator[Block]:
        yield Block(0, self.n_rows or 1, self._columns, None)

    @contextlib.contextmanager
    def sink(self, path: Path, outputs: dict[str, Array]) -> Iterator[Write]:
        with path.open("wb") as file:
            yield lambda _, results: _write(file, {**self._table, **dict(zip(outputs, results, strict=True))})


def _write(file: IO[bytes], table: Mapping[str, Any]) -> None:
    """numpy.savez, but for the columns that are named as its own arguments."""
    with zipfile.ZipFile(file, "w", zipfile.ZIP_STORED, allowZip64=True) as archive:
        for name, column in table.items():
            with archive.open(f"{name}.npy", "w", force_zip64=True) as member:
                np.lib.format.write_array(member, np.asanyarray(column), allow_pickle=False)


class Folder(Source):
    """A folder of .npy files, a column each. Those that do not collide are copied as they are, unread."""

    is_folder = True

    def __init__(self, path: Path) -> None:
        try:
            self._files = {file.stem: file for file in sorted(path.iterdir()) if file.suffix == ".npy"}
        except OSError as error:
            raise TableError(f"cannot be read ({error.strerror})") from None
        for name, file in self._files.items():
            if not file.is_file():
                raise TableError(f"column {name}: is not a file")
        self.names, self.n_rows = list(self._files), None

    def select(self, columns: Columns) -> dict[str, Array]:
        for name in columns.outputs:
            if Path(name).name != name:
                raise TableError(f"column {name}: cannot be the name of a file")
        self._columns = {argument: self._map(name) for argument, name in columns.inputs.items()}
        self._inputs = columns.inputs
        self.n_rows = _n_rows(columns, self._columns)
        return {argument: column[:0] if column.ndim else column for argument, column in self._columns.items()}

    def _map(self, name: str) -> Any:
        column: Any
        try:
            column = np.load(self._files[name], mmap_mode="r", allow_pickle=False)
        except _UNREADABLE as error:
            raise TableError(f"column {name}: cannot be read as an .npy file of numbers ({_why(error)})") from None
        if not hasattr(column, "_mmap"):
            raise TableError(f"column {name}: is no .npy file")
        if column.size:
            column._mmap.madvise(mmap.MADV_SEQUENTIAL)
        return column

    def _opened(self, name: str) -> IO[bytes]:
        try:
            return self._files[name].open("rb")
        except OSError as error:
            raise TableError(f"column {name}: cannot be read ({error.strerror})") from None

    def blocks(self) -> Iterator[Block]:
        n_rows = self.n_rows
        if n_rows is None:
            yield Block(0, 1, self._columns, slice(None))
            return
        for start in range(0, n_rows, ROWS):
            rows = slice(start, min(start + ROWS, n_rows))
            arrays = {argument: c[rows] if c.ndim else c for argument, c in self._columns.items()}
            yield Block(start, rows.stop - start, arrays, rows)

    @contextlib.contextmanager
    def sink(self, path: Path, outputs: dict[str, Array]) -> Iterator[Write]:
        for name in self._files:
            if name not in self._inputs.values():
                with self._opened(name) as original, (path / f"{name}.npy").open("wb") as copy:
                    shutil.copyfileobj(original, copy, 1 << 20)
        with contextlib.ExitStack() as stack:

            def create(name: str) -> IO[bytes]:
                return stack.enter_context((path / f"{name}.npy").open("wb"))

            copies = [(self._columns[argument], create(name)) for argument, name in self._inputs.items()]
            for (column, file), name in zip(copies, self._inputs.values(), strict=True):
                with self._opened(name) as original:
                    file.write(original.read(column.offset))  # its header
            results = [create(name) for name in outputs]
            for file, u in zip(results, outputs.values(), strict=True):
                shape = () if self.n_rows is None else (self.n_rows,)
                header = {"descr": u.dtype.str, "fortran_order": False, "shape": shape}
                np.lib.format.write_array_header_1_0(file, header)

            def write(block: Block, after: Sequence[Array]) -> None:
                for column, file in copies:
                    if column.ndim or block.start == 0:
                        file.write(np.ascontiguousarray(column[block.rest] if column.ndim else column).data)
                    # Or the pages of the file would count as memory of this process.
                    column._mmap.madvise(mmap.MADV_DONTNEED)
                for u, file in zip(after, results, strict=True):
                    file.write(np.ascontiguousarray(u).data)

            yield write


def _n_rows(columns: Columns, arrays: Mapping[str, Array]) -> int | None:
    """Of the columns that collide, which have to be of equal length, or single numbers; None if all are."""
    length, first = None, ""
    for argument, column in arrays.items():
        name = columns.inputs[argument]
        if column.ndim > 1:
            raise TableError(f"column {name}: has {column.ndim} dimensions, must have 1")
        if column.dtype.kind not in "biuf" or column.dtype.itemsize > 8:
            raise ColumnTypeError(f"column {name}: has dtype {column.dtype}, must be a real number")
        if column.ndim == 1 and length is None:
            length, first = column.shape[0], name
        if column.ndim == 1 and column.shape[0] != length:
            rows = min(column.shape[0], length or 0)
            raise TableError(
                f"column {name}: has {column.shape[0]} rows where {first} has {length}; they part at row {rows}"
            )
    return length


def _why(error: BaseException) -> str:
    return " ".join(str(error).split()) or type(error).__name__

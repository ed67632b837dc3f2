"""Tables in NumPy's own formats: an .npz file, in memory, and a folder of .npy columns, of any size."""

from __future__ import annotations

import contextlib
import zipfile
import zlib
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import IO, Any

import numpy as np

from .._system import renaming
from .._typing import Array
from . import stream
from .by_name import Columns, ColumnTypeError, TableError, counted
from .stream import Block, Source, Write, check_size, size

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
    """An .npz file. It is one block, with columns of any shape beside those of the arguments."""

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

    def close(self) -> None:
        pass

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
    """A folder of .npy files, a column each. Those that do not collide are copied as they are, whatever is in them.

    Files are read, not mapped: of a mapped one, what another process truncates or the disk cannot read is the end of
    this process (SIGBUS), and here an error.
    """

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
        self._open = contextlib.ExitStack()

    def close(self) -> None:
        self._open.close()

    def select(self, columns: Columns) -> dict[str, Array]:
        for name in columns.outputs:
            if not renaming.can_be_called(name):
                raise TableError(f"column {name}: cannot be the name of a file")
        self._columns = {argument: self._column(name) for argument, name in columns.inputs.items()}
        shaped = {argument: column.shaped for argument, column in self._columns.items()}
        self.n_rows = _n_rows(columns, shaped)
        self._single = {argument: c.read(0, ()) for argument, c in self._columns.items() if not c.shaped.ndim}
        return {argument: c[:0] if c.ndim else self._single[argument] for argument, c in shaped.items()}

    def _column(self, name: str) -> _Column:
        return _Column(name, self._open.enter_context(_opened(name, self._files[name])))

    def blocks(self) -> Iterator[Block]:
        if self.n_rows is None:
            yield Block(0, 1, self._single, None)
        for start in range(0, self.n_rows or 0, stream.ROWS):
            n_rows = min(stream.ROWS, (self.n_rows or 0) - start)
            rows = {argument: c.read(start, (n_rows,)) for argument, c in self._columns.items() if c.shaped.ndim}
            yield Block(start, n_rows, {**self._single, **rows}, None)
        for column in self._columns.values():
            column.check()

    @contextlib.contextmanager
    def sink(self, path: Path, outputs: dict[str, Array]) -> Iterator[Write]:
        colliding = {column.name for column in self._columns.values()}
        for name in self._files:
            if name not in colliding:
                with _opened(name, self._files[name]) as original, _created(path, name) as copy:
                    for chunk in _chunks(name, original):
                        copy.write(chunk)
        with contextlib.ExitStack() as stack:
            columns = self._columns.items()
            copies = {argument: stack.enter_context(_created(path, column.name)) for argument, column in columns}
            for argument, file in copies.items():
                file.write(self._columns[argument].header)
                if argument in self._single:
                    file.write(self._single[argument].data)
            results = [stack.enter_context(_created(path, name)) for name in outputs]
            for file, u in zip(results, outputs.values(), strict=True):
                shape = () if self.n_rows is None else (self.n_rows,)
                header = {"descr": u.dtype.str, "fortran_order": False, "shape": shape}
                np.lib.format.write_array_header_1_0(file, header)

            def write(block: Block, after: Sequence[Array]) -> None:
                for argument, file in copies.items():
                    if argument not in self._single:
                        file.write(block.arrays[argument].data)
                for u, file in zip(after, results, strict=True):
                    file.write(np.ascontiguousarray(u).data)

            yield write


def _opened(name: str, path: Path) -> IO[bytes]:
    try:
        return path.open("rb")
    except OSError as error:
        raise TableError(f"column {name}: cannot be read ({error.strerror})") from None


def _created(folder: Path, name: str) -> IO[bytes]:
    """A new column; not over another, whose name is the same to a system that takes v1 and V1 for one."""
    try:
        return (folder / f"{name}.npy").open("xb")
    except FileExistsError:
        raise TableError(f"column {name}: there is one whose name is the same to this system") from None


def _chunks(name: str, file: IO[bytes]) -> Iterator[bytes]:
    """All of a file."""
    n_bytes = size(file.fileno())
    try:
        while chunk := file.read(1 << 20):
            yield chunk
    except OSError as error:
        raise TableError(f"column {name}: cannot be read ({error.strerror})") from None
    check_size(file.fileno(), n_bytes, f"column {name}")


# By the version of the format. In the third, names of fields are of another encoding: no argument column has any.
_READ_HEADER = {
    (1, 0): np.lib.format.read_array_header_1_0,
    (2, 0): np.lib.format.read_array_header_2_0,
    (3, 0): np.lib.format.read_array_header_2_0,
}


class _Column:
    """An .npy file, from which the numbers are read in order."""

    def __init__(self, name: str, file: IO[bytes]) -> None:
        self.name, self._file, self._size = name, file, size(file.fileno())
        try:
            version = np.lib.format.read_magic(file)
        except ValueError:
            raise TableError(f"column {name}: is no .npy file") from None
        try:
            shape, _, self._dtype = _READ_HEADER[version](file)
            # Of its shape and type, and without its content: it takes no memory.
            self.shaped = np.broadcast_to(np.zeros((), self._dtype), (*shape, *self._dtype.shape))
            length = file.tell()
            n_bytes = length + self.shaped.size * self.shaped.itemsize
            if n_bytes > self._size:
                raise EOFError(f"of its {n_bytes:,} bytes there are {self._size:,}")
            file.seek(0)
            self.header = file.read(length)
        except _UNREADABLE as error:
            raise TableError(f"column {name}: cannot be read as an .npy file of numbers ({_why(error)})") from None

    def read(self, start: int, shape: tuple[int, ...]) -> Array:
        """The next rows, of which the first has this number."""
        rows = np.empty(shape, self._dtype)
        try:
            n_bytes = self._file.readinto(rows)  # type: ignore[attr-defined]
        except OSError as error:
            raise TableError(f"column {self.name}: row {start}: cannot be read ({error.strerror})") from None
        if n_bytes < rows.nbytes:
            row = start + n_bytes // rows.itemsize
            raise TableError(f"column {self.name}: row {row}: the file has been truncated while it was read")
        return rows

    def check(self) -> None:
        check_size(self._file.fileno(), self._size, f"column {self.name}")


def _n_rows(columns: Columns, arrays: Mapping[str, Array]) -> int | None:
    """The length of the argument columns, which has to be one, or they are single numbers; None if all are."""
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
                f"column {name}: has {counted(column.shape[0], 'row')} where {first} has {length:,}; "
                f"they part at row {rows}"
            )
    return length


def _why(error: BaseException) -> str:
    return " ".join(str(error).split()) or type(error).__name__

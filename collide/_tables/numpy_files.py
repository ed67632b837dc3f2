"""Tables in NumPy's own formats: an .npz file, in memory, and a folder of .npy columns, of any size."""

from __future__ import annotations

import contextlib
import functools
import zipfile
import zlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import IO, Any, cast

import numpy as np

from .._system import renaming
from .._system.messages import reason
from .._typing import Array
from . import stream
from .by_name import Columns, ColumnTypeError, TableError, cannot_hold, counted
from .standard import Place, created
from .stream import ArrowTable, Block, NumpyTable, Sink, Source, Whole, Write, check_size, size

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


class NumpySource(Source):
    """What it holds as NumPy does, Arrow can hold in part."""

    def as_arrow(self, target: str) -> ArrowTable:
        from .conversion import to_arrow  # needs pyarrow

        return to_arrow(self.as_numpy(target), self.names, target)


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
        except _UNREADABLE as error:
            column = f"column {name}: " if name else ""
            raise TableError(f"{column}cannot be read as a .npz file of plain arrays ({_why(error)})") from None
        self.names, self.n_rows = list(self._table), None

    def select(self, columns: Columns) -> dict[str, Array]:
        self._columns = {argument: self._table[name] for argument, name in columns.inputs.items()}
        self.n_rows = _n_rows(columns, self._columns)
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
        rows = {name: column for name, column in self._table.items() if _is_by_rows(column, self.n_rows)}
        others = {
            name: Whole(c, functools.partial(np.asarray, c)) for name, c in self._table.items() if name not in rows
        }

        def of(block: Block) -> dict[str, Array]:
            return {name: column[block.table] for name, column in rows.items()}

        return NumpyTable({name: column.dtype for name, column in rows.items()}, others, of)

    def as_arrow(self, target: str) -> ArrowTable:
        self._at_once = stream.ROWS  # what Arrow makes of all rows at once would be in memory twice
        return super().as_arrow(target)


class ArchiveSink(Sink):
    """In memory until its end."""

    def __init__(self, source: Source, outputs: dict[str, Array]) -> None:
        self._names, self._outputs = source.names, outputs
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


def _is_by_rows(column: Array, n_rows: int | None) -> bool:
    return column.shape == (n_rows,) and column.dtype.kind in "biufUSMm"


def _write(file: IO[bytes], table: Mapping[str, Any]) -> None:
    """numpy.savez, but for the columns that are named as its own arguments."""
    with zipfile.ZipFile(file, "w", zipfile.ZIP_STORED, allowZip64=True) as archive:
        for name, column in table.items():
            with archive.open(f"{name}.npy", "w", force_zip64=True) as member:
                np.lib.format.write_array(member, np.asanyarray(column), allow_pickle=False)


class Folder(NumpySource):
    """A folder of .npy files, a column each.

    Files are read, not mapped: of a mapped one, what another process truncates or the disk cannot read is the end of
    this process (SIGBUS), and here an error.
    """

    def __init__(self, path: Path) -> None:
        try:
            self._files = {file.stem: file for file in sorted(path.iterdir()) if file.suffix == ".npy"}
        except OSError as error:
            raise TableError(f"cannot be read ({reason(error)})") from None
        for name, file in self._files.items():
            if not file.is_file():
                raise TableError(f"column {name}: is not a file")
        self.names, self.n_rows = list(self._files), None
        self._open = contextlib.ExitStack()
        self._others: dict[str, _Column] = {}  # that are read as well

    def close(self) -> None:
        self._open.close()

    def select(self, columns: Columns) -> dict[str, Array]:
        self._columns = {argument: self._column(name) for argument, name in columns.inputs.items()}
        shaped = {argument: column.shaped for argument, column in self._columns.items()}
        self.n_rows = _n_rows(columns, shaped)
        self._single = {argument: c.read(0, ()) for argument, c in self._columns.items() if not c.shaped.ndim}
        return {argument: c[:0] if c.ndim else self._single[argument] for argument, c in shaped.items()}

    def _column(self, name: str) -> _Column:
        return _Column(name, self._open.enter_context(_opened(name, self._files[name])))

    def blocks(self) -> Iterator[Block]:
        if self.n_rows is None:
            yield Block(0, 1, self._single, {})
        for start in range(0, self.n_rows or 0, stream.ROWS):
            n_rows = min(stream.ROWS, (self.n_rows or 0) - start)
            rows = {argument: c.read(start, (n_rows,)) for argument, c in self._columns.items() if c.shaped.ndim}
            others = {name: column.read(start, (n_rows,)) for name, column in self._others.items()}
            yield Block(start, n_rows, {**self._single, **rows}, others)
        for column in (*self._columns.values(), *self._others.values()):
            column.check()

    def as_numpy(self, target: str) -> NumpyTable:
        arguments = {column.name: argument for argument, column in self._columns.items()}
        rows, whole = {}, {}
        for name in self.names:
            if name in arguments and arguments[name] in self._single:
                single = self._single[arguments[name]]
                whole[name] = Whole(single, functools.partial(np.asarray, single))
                continue
            column = self._columns[arguments[name]] if name in arguments else self._column(name)
            if _is_by_rows(column.shaped, self.n_rows):
                rows[name] = column.shaped.dtype
                if name not in arguments:
                    self._others[name] = column
            else:
                whole[name] = Whole(column.shaped, column.load)

        def of(block: Block) -> dict[str, Array]:
            return {n: block.arrays[arguments[n]] if n in arguments else block.table[n] for n in rows}

        return NumpyTable(rows, whole, of)

    def copy(self, folder: Path, stack: contextlib.ExitStack) -> Callable[[Block], object]:
        """Copies the columns as they are: those that do not collide at once, whatever is in them; of the others, what
        the function that is returned is given.
        """
        colliding = {column.name for column in self._columns.values()}
        for name in self._files:
            if name not in colliding:
                with _opened(name, self._files[name]) as original, _created(folder, name) as copy:
                    for chunk in _chunks(name, original):
                        copy.write(chunk)
        copies = {arg: stack.enter_context(_created(folder, column.name)) for arg, column in self._columns.items()}
        for argument, file in copies.items():
            file.write(self._columns[argument].header)
            if argument in self._single:
                file.write(self._single[argument].data)

        def write(block: Block) -> None:
            for argument, file in copies.items():
                if argument not in self._single:
                    file.write(block.arrays[argument].data)

        return write


class FolderSink(Sink):
    """A column a file. Those of another folder are copied, those of any other source are written anew."""

    def __init__(self, source: Source, outputs: dict[str, Array]) -> None:
        self._outputs = outputs
        self._folder = source if isinstance(source, Folder) else None
        for name in (*(source.names if self._folder is None else ()), *outputs):
            if not (name and renaming.can_be_called(name)):
                raise TableError(f"column {name}: cannot be the name of a file")
        if self._folder is None:
            self._table = source.as_numpy("a folder of .npy files")
            for name, dtype in self._table.rows.items():
                if not dtype.itemsize:
                    raise cannot_hold(name, "has type string", "a folder of .npy files")

    @contextlib.contextmanager
    def open(self, place: Place) -> Iterator[Write]:
        folder = cast(Path, place)
        with contextlib.ExitStack() as stack:
            copy = self._folder.copy(folder, stack) if self._folder else self._written(folder, stack)
            results = [stack.enter_context(_new_column(folder, name, u)) for name, u in self._outputs.items()]

            def write(block: Block, after: Sequence[Array]) -> None:
                copy(block)
                for u, add in zip(after, results, strict=True):
                    add(u)

            yield write

    def _written(self, folder: Path, stack: contextlib.ExitStack) -> Callable[[Block], object]:
        """All columns; of those of a value a row, what the function that is returned is given."""
        for name, column in self._table.whole.items():
            with _created(folder, name) as file:
                np.lib.format.write_array(file, column.load(), allow_pickle=False)
        columns = {
            name: stack.enter_context(_new_column(folder, name, np.empty(0, dtype)))
            for name, dtype in self._table.rows.items()
        }

        def write(block: Block) -> None:
            for name, rows in self._table.of(block).items():
                columns[name](rows)

        return write


@contextlib.contextmanager
def _new_column(folder: Path, name: str, like: Array) -> Iterator[Callable[[Array], object]]:
    """What adds rows to a new column; their number is written above them at the end: NumPy leaves room for it."""
    with _created(folder, name) as file:
        n_rows = 0

        def write_header() -> None:
            shape = (n_rows,) if like.ndim else ()
            header = {"descr": like.dtype.str, "fortran_order": False, "shape": shape}
            np.lib.format.write_array_header_1_0(file, header)

        def add(rows: Array) -> None:
            nonlocal n_rows
            n_rows += rows.size
            file.write(np.ascontiguousarray(rows).reshape(-1).view(np.uint8).data)

        write_header()
        yield add
        file.seek(0)
        write_header()


def _opened(name: str, path: Path) -> IO[bytes]:
    try:
        return path.open("rb")
    except OSError as error:
        raise TableError(f"column {name}: cannot be read ({reason(error)})") from None


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
        raise TableError(f"column {name}: cannot be read ({reason(error)})") from None
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
            raise TableError(f"column {self.name}: row {start}: cannot be read ({reason(error)})") from None
        if n_bytes < rows.nbytes:
            row = start + n_bytes // rows.itemsize
            raise TableError(f"column {self.name}: row {row}: the file has been truncated while it was read")
        return rows

    def load(self) -> Array:
        """All of it."""
        self._file.seek(0)
        try:
            return np.load(self._file, allow_pickle=False)  # type: ignore[no-any-return]
        except _UNREADABLE as error:
            raise TableError(f"column {self.name}: cannot be read as an .npy file ({_why(error)})") from None

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

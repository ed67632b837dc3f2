"""Tables as folders of .npy files, a column each, of any size."""

from __future__ import annotations

import contextlib
import functools
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import IO, cast

import numpy as np

from .._system import renaming
from .._system.messages import reason
from .._typing import Array
from .by_name import Columns, TableError, cannot_hold
from .numpy_files import UNREADABLE, NumpySource, is_by_rows, n_rows_of, rows_of_a_block, why
from .standard import Place
from .stream import Block, NumpyTable, Sink, Source, Whole, Write, check_size, size


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
        self.n_rows = n_rows_of(columns, shaped)
        self._single = {argument: c.read(0, ()) for argument, c in self._columns.items() if not c.shaped.ndim}
        return {argument: c[:0] if c.ndim else self._single[argument] for argument, c in shaped.items()}

    def _column(self, name: str) -> _Column:
        return _Column(name, self._open.enter_context(_opened(name, self._files[name])))

    def blocks(self) -> Iterator[Block]:
        if self.n_rows is None:
            yield Block(0, 1, self._single, {})
        at_once = rows_of_a_block(c.shaped.dtype for c in (*self._columns.values(), *self._others.values()))
        for start in range(0, self.n_rows or 0, at_once):
            n_rows = min(at_once, (self.n_rows or 0) - start)
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
            if is_by_rows(column.shaped, self.n_rows):
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
        except UNREADABLE as error:
            raise TableError(f"column {name}: cannot be read as an .npy file of numbers ({why(error)})") from None

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
        except UNREADABLE as error:
            raise TableError(f"column {self.name}: cannot be read as an .npy file ({why(error)})") from None

    def check(self) -> None:
        check_size(self._file.fileno(), self._size, f"column {self.name}")

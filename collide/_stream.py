"""A file of any size, block by block: read, resolved and written at once, and the output whole or not at all."""

from __future__ import annotations

import contextlib
import ctypes
import os
import shutil
import tempfile
from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

import numpy as np

from . import _tables
from ._conservation import Conservation
from ._tables import TableError

Array = np.ndarray[Any, np.dtype[Any]]
Item = TypeVar("Item")

# Of a block: enough for a row group of Parquet, and few enough to be in a cache from one step to the next.
ROWS = 1 << 17


class Block(NamedTuple):
    """A run of rows."""

    start: int  # the number of the first
    n_rows: int
    arrays: dict[str, Array]  # the columns that collide, by their arguments
    rest: Any  # what the sink has to know of it


Write = Callable[[Block, Sequence[Array]], object]


class Source(ABC):
    """A table in a file, and how one like it is written."""

    is_folder = False
    names: Sequence[str]
    n_rows: int | None  # None: not known yet

    @abstractmethod
    def select(self, columns: _tables.Columns) -> dict[str, Array]:
        """Settles which columns collide, and checks them; gives them without rows."""

    @abstractmethod
    def blocks(self) -> Iterator[Block]:
        """All rows, once. Whatever cannot be read is a TableError."""

    @abstractmethod
    def sink(self, path: Path, outputs: dict[str, Array]) -> contextlib.AbstractContextManager[Write]:
        """What writes the blocks and their results, called and of the dtypes as in `outputs`, to a new file."""


class Report(NamedTuple):
    """What has been done."""

    conservation: Conservation
    n_invalid: int


def resolve(
    source: Source,
    target: Path,
    columns: _tables.Columns,
    options: _tables.Options,
    progress: Callable[[int, int | None], Any],
) -> Report:
    """Resolves the pairs of one file into another; tells `progress` of each block's rows, and of all, when known."""
    _, like, _ = _tables.resolve(columns, source.select(columns), options)
    outputs = dict(zip(columns.outputs, map(np.asarray, like), strict=True))
    conservation = Conservation()

    def results() -> Iterator[tuple[Block, Sequence[Array], int]]:
        for block in ahead(source.blocks()):
            inputs, after, error = _tables.resolve(columns, block.arrays, options)
            if error and options.invalid == "raise":
                others = f" ({error.count} invalid pairs up to row {block.start + block.n_rows - 1})"
                row = block.start + (error.index[0] if error.index else 0)
                raise TableError(f"row {row}: {error.reason}{others if error.count > 1 else ''}")
            conservation.add(columns.form, inputs, after)
            yield block, after, error.count if error else 0

    n_invalid = 0
    with replacing(target, source.is_folder) as temporary, source.sink(temporary, outputs) as write:
        for block, after, n_more in ahead(results()):
            write(block, after)
            n_invalid += n_more
            progress(block.n_rows, source.n_rows)
    return Report(conservation, n_invalid)


def ahead(items: Iterable[Item], depth: int = 2) -> Iterator[Item]:
    """The items, made in a thread of their own, this many of them before they are asked for."""
    iterator, end = iter(items), object()
    with ThreadPoolExecutor(1) as pool:
        coming = deque(pool.submit(next, iterator, end) for _ in range(depth))
        while (item := coming.popleft().result()) is not end:
            coming.append(pool.submit(next, iterator, end))
            yield item  # type: ignore[misc]  # it is not the end


@contextlib.contextmanager
def replacing(path: Path, is_folder: bool) -> Iterator[Path]:
    """A new file or folder that takes the place of `path` when all is written, and vanishes on any error."""
    prefix = f".{path.name[:40]}."
    if is_folder:
        temporary = Path(tempfile.mkdtemp(".tmp", prefix, path.parent))
    else:
        handle, name = tempfile.mkstemp(".tmp", prefix, path.parent)
        os.close(handle)
        temporary = Path(name)
    try:
        yield temporary
        for written in (temporary, *temporary.iterdir()) if is_folder else (temporary,):
            _sync(written)
        mask = os.umask(0)
        os.umask(mask)
        temporary.chmod(path.stat().st_mode & 0o777 if path.exists() else (0o777 if is_folder else 0o666) & ~mask)
        if is_folder and path.exists():
            _exchange(temporary, path)
        else:
            temporary.replace(path)
    finally:  # gone if it has been renamed; after an exchange it is the old folder
        if is_folder:
            shutil.rmtree(temporary, ignore_errors=True)
        else:
            temporary.unlink(missing_ok=True)


def _sync(path: Path) -> None:
    """To the disk: a name must not be there before its content, whatever happens to the machine."""
    handle = os.open(path, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def _exchange(one: Path, other: Path) -> None:
    """Two folders change their names: at once where the system can, else with a moment in which `other` is away."""
    here, exchange = -100, 2  # AT_FDCWD, RENAME_EXCHANGE
    with contextlib.suppress(AttributeError, OSError):  # no such function in the C library
        if ctypes.CDLL(None).renameat2(here, os.fsencode(one), here, os.fsencode(other), exchange) == 0:
            return
    aside = one.with_suffix(".old")
    other.rename(aside)
    try:
        one.rename(other)
    except BaseException:
        aside.rename(other)
        raise
    aside.rename(one)

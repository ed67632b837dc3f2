"""A file of any size, block by block: read, resolved and written at once."""

from __future__ import annotations

import contextlib
import os
from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

import numpy as np

from .._typing import Array
from . import by_name
from .by_name import TableError
from .conservation import Conservation
from .replacement import output

Item = TypeVar("Item")

# Of a block: enough for a page of Parquet, and few enough to be in a cache from one step to the next.
ROWS = 1 << 17


class Block(NamedTuple):
    """A run of rows."""

    start: int  # the number of the first
    n_rows: int
    arrays: dict[str, Array]  # the argument columns, by the names of the arguments
    rest: Any  # what the sink has to know of it


Write = Callable[[Block, Sequence[Array]], object]


class Source(ABC):
    """A table in a file, and how one like it is written."""

    is_folder = False
    names: Sequence[str]
    n_rows: int | None  # None: not known yet

    @abstractmethod
    def select(self, columns: by_name.Columns) -> dict[str, Array]:
        """Settles which columns collide, and checks them; gives them without rows."""

    @abstractmethod
    def blocks(self) -> Iterator[Block]:
        """All rows, once. Whatever cannot be read is a TableError."""

    @abstractmethod
    def close(self) -> None:
        """Lets go of the file."""

    @abstractmethod
    def sink(self, path: Path, outputs: dict[str, Array]) -> contextlib.AbstractContextManager[Write]:
        """What writes the blocks and their results, called and of the dtypes as in `outputs`, to a new file."""


class Report(NamedTuple):
    """What has been done."""

    conservation: Conservation
    n_invalid: int


def run(
    source: Source,
    target: Path,
    overwrite: bool,
    columns: by_name.Columns,
    options: by_name.Options,
    progress: Callable[[int, int | None], Any],
) -> Report:
    """Resolves the pairs of one file into another; tells `progress` of each block's rows, and of all, when known."""
    _, like, _ = by_name.results_of(columns, source.select(columns), options)
    outputs = dict(zip(columns.outputs, map(np.asarray, like), strict=True))
    conservation = Conservation()

    def results() -> Iterator[tuple[Block, Sequence[Array], int]]:
        for block in ahead(source.blocks()):
            inputs, after, error = by_name.results_of(columns, block.arrays, options)
            if error and options.invalid == "raise":
                others = f" ({error.count} invalid pairs up to row {block.start + block.n_rows - 1})"
                row = block.start + (error.index[0] if error.index else 0)
                raise TableError(f"row {row}: {error.reason}{others if error.count > 1 else ''}")
            conservation.add(columns.form, inputs, after)
            yield block, after, error.count if error else 0

    n_invalid = 0
    with (
        contextlib.closing(ahead(results())) as coming,
        output(target, source.is_folder, overwrite) as temporary,
        source.sink(temporary, outputs) as write,
    ):
        for block, after, n_more in coming:
            write(block, after)
            n_invalid += n_more
            progress(block.n_rows, source.n_rows)
    return Report(conservation, n_invalid)


def ahead(items: Iterable[Item], depth: int = 2) -> Generator[Item, None, None]:
    """The items, made in a thread of their own, this many of them before they are asked for."""
    iterator, end = iter(items), object()
    with ThreadPoolExecutor(1) as pool:
        coming = deque(pool.submit(next, iterator, end) for _ in range(depth))
        while (item := coming.popleft().result()) is not end:
            coming.append(pool.submit(next, iterator, end))
            yield item  # type: ignore[misc]  # it is not the end


@contextlib.contextmanager
def behind(call: Callable[..., object]) -> Iterator[Callable[..., None]]:
    """The same call, made in a thread of its own while its caller goes on. The next one, and the end, wait for it."""
    with ThreadPoolExecutor(1) as pool:
        last: Future[object] = pool.submit(lambda: None)

        def again(*arguments: Any) -> None:
            nonlocal last
            last.result()
            last = pool.submit(call, *arguments)

        yield again
        last.result()


def size(handle: int) -> int:
    """Of an open file, in bytes."""
    return os.fstat(handle).st_size


def check_size(handle: int, n_bytes: int, where: str) -> None:
    """Whoever writes to a file while it is read makes a part of it out of it, which often can be read all the same."""
    now = size(handle)
    if now != n_bytes:
        raise TableError(
            f"{where}: the file has changed while it was read, from {n_bytes:,} to {now:,} bytes"
        ) from None

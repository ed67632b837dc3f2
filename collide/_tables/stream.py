"""A file of any size, block by block: read, resolved and written at once."""

from __future__ import annotations

import contextlib
import os
from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Callable, Generator, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Any, NamedTuple, TypeVar

import numpy as np

from .._typing import Array
from . import by_name
from .by_name import TableError
from .conservation import Conservation
from .standard import Place

Item = TypeVar("Item")

# Of a block: enough for a page of Parquet, and few enough to be in a cache from one step to the next.
ROWS = 1 << 17


class Block(NamedTuple):
    """A run of rows."""

    start: int  # the number of the first
    n_rows: int
    arrays: dict[str, Array]  # the argument columns, by the names of the arguments
    table: Any  # what the source has read, as it holds it


class Whole(NamedTuple):
    """A column of NumPy's that is not one of a value a row: a single number, a matrix, one of another length."""

    shaped: Array  # of its shape and dtype, maybe without its content
    load: Callable[[], Array]


class NumpyTable(NamedTuple):
    """The columns of a source as NumPy holds them, by name."""

    rows: Mapping[str, np.dtype[Any]]  # those of a value a row; text of any length has the dtype "U", of no size
    whole: Mapping[str, Whole]
    of: Callable[[Block], Mapping[str, Array]]  # the rows of a block


class ArrowTable(NamedTuple):
    """The columns of a source as Arrow holds them."""

    schema: Any
    of: Callable[[Block], Any]  # the record batch of a block


Write = Callable[[Block, Sequence[Array]], object]


class Source(ABC):
    """A table that is read. Whatever cannot be is a TableError.

    All columns are there for any sink to take, as NumPy holds them or as Arrow does, and for a sink of the same format
    as they stand. What `target`, a kind of file, cannot hold is a TableError before anything is read.
    """

    names: Sequence[str]
    n_rows: int | None  # None: not known yet

    @abstractmethod
    def select(self, columns: by_name.Columns) -> dict[str, Array]:
        """Settles which columns collide, and checks them; gives them without rows."""

    @abstractmethod
    def blocks(self) -> Iterator[Block]:
        """All rows, once, in blocks that have some."""

    @abstractmethod
    def as_numpy(self, target: str) -> NumpyTable: ...

    @abstractmethod
    def as_arrow(self, target: str) -> ArrowTable: ...

    def place_of(self, row: int) -> str:
        """Where a row stands, for a message, if that is not what its number says."""
        return ""

    def stop(self) -> None:  # noqa: B027  # most wait for nothing
        """No more is wanted: who waits for what may never come waits no longer."""

    @abstractmethod
    def close(self) -> None:
        """Lets go of the file."""


class Sink(ABC):
    """A table that is written: the columns of a source, and the results after them."""

    @abstractmethod
    def __init__(self, source: Source, outputs: dict[str, Array]) -> None:
        """`outputs` has the names, dtypes and dimensions of the results. What cannot be held is a TableError."""

    @abstractmethod
    def open(self, place: Place) -> contextlib.AbstractContextManager[Write]:
        """What writes the blocks and their results there."""


class Report(NamedTuple):
    """What has been done."""

    conservation: Conservation
    n_invalid: int


def run(
    source: Source,
    new_sink: Callable[[Source, dict[str, Array]], Sink],
    target: contextlib.AbstractContextManager[Place],
    columns: by_name.Columns,
    options: by_name.Options,
    progress: Callable[[int, int | None], Any],
) -> Report:
    """Resolves the pairs of one table into another; tells `progress` of each block's rows, and of all, when known."""
    _, like, _ = by_name.results_of(columns, source.select(columns), options)
    sink = new_sink(source, dict(zip(columns.outputs, map(np.asarray, like), strict=True)))
    conservation = Conservation()

    def results() -> Iterator[tuple[Block, Sequence[Array], int]]:
        for block in ahead(source.blocks(), source.stop):
            inputs, after, error = by_name.results_of(columns, block.arrays, options)
            if error and options.invalid == "raise":
                row = block.start + (error.index[0] if error.index else 0)
                others = f" ({error.count} invalid pairs up to row {block.start + block.n_rows - 1})"
                raise TableError(
                    f"row {row}: {error.reason}{others if error.count > 1 else ''}; "
                    "--invalid keep or --invalid nan goes on with the others",
                    row,
                )
            conservation.add(columns.form, inputs, after)
            yield block, after, error.count if error else 0

    n_invalid = 0
    with (
        contextlib.closing(ahead(results(), source.stop)) as coming,
        target as place,
        sink.open(place) as write,
    ):
        for block, after, n_more in coming:
            write(block, after)
            n_invalid += n_more
            progress(block.n_rows, source.n_rows)
    return Report(conservation, n_invalid)


def ahead(
    items: Iterable[Item], stop: Callable[[], object] = lambda: None, depth: int = 2
) -> Generator[Item, None, None]:
    """The items, made in a thread of their own, this many of them before they are asked for.

    `stop` is called where no more are wanted, before that thread is waited for.
    """
    iterator, end = iter(items), object()
    with ThreadPoolExecutor(1) as pool:
        try:
            coming = deque(pool.submit(next, iterator, end) for _ in range(depth))
            while (item := coming.popleft().result()) is not end:
                coming.append(pool.submit(next, iterator, end))
                yield item  # type: ignore[misc]  # it is not the end
        except BaseException:
            stop()
            raise


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

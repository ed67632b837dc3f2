"""Standard input and output, where a table may come from a pipe and go into one."""

from __future__ import annotations

import contextlib
import io
import os
import queue
import sys
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO, cast

_PIECE = 1 << 20


class Input:
    """Standard input, for whose readers a thread of its own waits: they may be told that no more is wanted.

    Not Python's own file: where a thread waits in that, the process cannot end.
    """

    closed = False  # which pyarrow asks

    def __init__(self) -> None:
        self._ended, self._position, self._have = False, 0, bytearray()
        self._coming: queue.Queue[bytes | OSError] = queue.Queue(4)
        threading.Thread(target=self._fetch, args=(sys.stdin.fileno(),), daemon=True).start()

    def _fetch(self, handle: int) -> None:
        piece: bytes | OSError = b"any"
        while piece and not isinstance(piece, OSError) and not self._ended:
            try:
                piece = os.read(handle, _PIECE)
            except OSError as error:
                piece = error
            self._coming.put(piece)

    def peek(self, n_bytes: int) -> bytes:
        """As many bytes, or all that come, which stay to be read."""
        while len(self._have) < n_bytes and not self._ended:
            piece = self._coming.get()
            if isinstance(piece, OSError):
                raise piece
            self._have += piece
            self._ended = self._ended or not piece
        return bytes(self._have[:n_bytes])

    def read(self, n_bytes: int) -> bytes:
        """As many bytes, or all that come."""
        piece = self.peek(n_bytes)
        del self._have[: len(piece)]
        self._position += len(piece)
        return piece

    def tell(self) -> int:
        return self._position

    def close(self) -> None:
        """It ends here: who waits for more waits no longer."""
        self._ended = True
        with contextlib.suppress(queue.Empty):
            while True:
                self._coming.get_nowait()
        self._coming.put(b"")


Place = Path | BinaryIO  # to which a table is written: a file or folder, or standard output


@contextlib.contextmanager
def output() -> Iterator[BinaryIO]:
    """Standard output, on which there is all that has been written, whatever comes after."""
    file = sys.stdout.buffer
    yield cast(BinaryIO, _Unbuffered(file)) if isinstance(file, io.RawIOBase) else file
    file.flush()


class _Unbuffered:
    """Standard output under PYTHONUNBUFFERED, which by itself writes what fits, and says how much that was."""

    closed = False  # which pyarrow asks

    def __init__(self, file: io.RawIOBase) -> None:
        self._file = file

    def write(self, data: bytes) -> None:
        left = memoryview(data).cast("B")
        while left:
            left = left[self._file.write(left) :]

    def flush(self) -> None:
        pass


@contextlib.contextmanager
def created(place: Place) -> Iterator[BinaryIO]:
    """A new file, which is closed at the end, or standard output, which is not."""
    if isinstance(place, Path):
        with place.open("wb") as file:
            yield file
    else:
        yield place

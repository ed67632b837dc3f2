"""What is being done, in one line on standard error, where that is a terminal."""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Callable, Iterator


@contextlib.contextmanager
def status_line() -> Iterator[Callable[[str], None]]:
    """A function that writes the line in the place of the one before; none is left at the end, nor after ""."""
    if sys.stderr is None or not sys.stderr.isatty():
        yield lambda line: None
        return
    length = 0

    def show(line: str) -> None:
        nonlocal length
        print(f"\r{line.ljust(length)}", end="" if line else "\r", file=sys.stderr, flush=True)
        length = len(line)

    try:
        yield show
    finally:
        show("")

"""What signals do to the command line. Where the package is a library, this changes nothing.

Ctrl-C while it is still importing gives one line and status 130, as later on. An exception would not do: what imports
may swallow it, or make another of it, and Python shows where it came from. So the process ends at once, which loses
nothing: nothing has been done yet. What comes before the package's first line, some 20 ms in which Python itself
starts, is Python's.
"""

from __future__ import annotations

import contextlib
import os
import re
import signal
import sys
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import NoReturn


def _is_the_command() -> bool:
    """Whether this is `python -m collide`, or the script of that name."""
    arguments = getattr(sys, "argv", None) or [""]
    if arguments[0] == "-m":  # as long as Python is looking for the module, which stands before its arguments
        return re.fullmatch("(-.*m)?collide", "".join(sys.orig_argv[-len(arguments) :][:1])) is not None
    return Path(arguments[0]).stem == "collide"


THE_COMMAND = _is_the_command()


@contextlib.contextmanager
def interruptible() -> Iterator[None]:
    """Imports, which an interrupt ends with the process, if it is the command's."""
    in_main = threading.current_thread() is threading.main_thread()  # which alone may set handlers
    if not (THE_COMMAND and in_main and signal.getsignal(signal.SIGINT) in (signal.default_int_handler, _end)):
        yield
        return
    signal.signal(signal.SIGINT, _end)
    try:
        yield
    finally:
        if sys.argv[0] != "-m":  # or else Python comes to __main__ next, and to the same again
            signal.signal(signal.SIGINT, signal.default_int_handler)


def _end(number: int, frame: object) -> NoReturn:
    try:
        os.write(2, b"collide: interrupted\n")
    finally:
        os._exit(128 + number)


# A termination, a terminal that is closed; on Windows, where neither comes as a signal, Ctrl-Break.
ENDS = [getattr(signal, name) for name in ("SIGTERM", "SIGHUP", "SIGBREAK") if hasattr(signal, name)]


@contextlib.contextmanager
def ending() -> Iterator[None]:
    """Where a termination, too, removes the temporary file, and a terminal that is closed."""
    before = {}
    try:
        for number in ENDS:
            if signal.getsignal(number) == signal.SIG_DFL:
                with contextlib.suppress(ValueError):  # not the main thread
                    before[number] = signal.signal(number, lambda number, _: sys.exit(128 + number))
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)

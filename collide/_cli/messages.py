"""What the command line says, and where."""

from __future__ import annotations

import os
import re
import sys
from pathlib import Path

STANDARD = Path("-")  # this one stands for standard input and output, and no other: ./- is a file


class UsageError(Exception):
    """The command line is at fault."""


def fail(message: object, status: int) -> int:
    """In one line. Bytes of a name that are no text stand in it as \\xe9."""
    line = re.sub("[\udc80-\udcff]", lambda byte: f"\\x{ord(byte[0]) - 0xDC00:x}", " ".join(str(message).splitlines()))
    print(f"collide: {line}", file=sys.stderr)
    return status


def named(place: object, standard: str) -> str:
    """A file or folder, or what stands for standard input or output."""
    return standard if place is STANDARD else str(place)


def say(line: str) -> None:
    """On standard output, which may be full or gone: the work is done all the same."""
    try:
        print(line, flush=True)
    except OSError as error:
        give_up_output()
        fail(f"standard output: {error.strerror}", 0)


def give_up_output() -> None:
    """If it cannot be written, or Python complains once more at its end."""
    try:
        print(end="", flush=True)
    except OSError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())

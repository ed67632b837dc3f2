"""Processes of their own, which find the package where these tests have found it."""

import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import collide

PIPE = subprocess.PIPE


def environment(**variables: object) -> dict[str, str]:
    """That of this process, and these variables; None takes one away."""
    wanted = {**os.environ, "PYTHONPATH": Path(collide.__file__).parents[1], **variables}
    return {name: str(value) for name, value in wanted.items() if value is not None}


def run(*command: object, timeout: float = 120, **options: Any) -> subprocess.CompletedProcess[Any]:
    """What has ended, whatever its status is: it may be what the test is about. A hang fails."""
    return subprocess.run(_words(command), timeout=timeout, check=False, **_defaults(stderr=PIPE) | options)


def python(code: str, *arguments: object, **options: Any) -> subprocess.CompletedProcess[Any]:
    """As `run`, of code."""
    return run(sys.executable, "-c", code, *arguments, **options)


def printed_by(code: str, *arguments: object, **options: Any) -> str:
    """What the code prints; a hang, a crash and anything on stderr fail."""
    done = python(code, *arguments, **options)
    assert (done.returncode, done.stderr) == (0, ""), done.stdout
    return str(done.stdout)


@contextmanager
def running(*command: object, **options: Any) -> Iterator[subprocess.Popen[Any]]:
    """A process while it runs. What has not ended by itself is killed."""
    with subprocess.Popen(_words(command), **_defaults() | options) as process:
        try:
            yield process
        finally:
            process.kill()


def _words(command: tuple[object, ...]) -> list[str]:
    return [str(word) for word in command]


def _defaults(**more: object) -> dict[str, Any]:
    return {"env": environment(), "stdout": PIPE, "text": True, **more}

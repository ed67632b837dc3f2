"""`collide bench`: the measurements of the benchmarks, which stand beside the package where its sources are."""

from __future__ import annotations

import contextlib
import importlib.util
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

from .messages import UsageError

SUITE = Path(__file__).parents[2] / "benchmarks"


def main(arguments: Sequence[str]) -> int:
    """The exit status of pytest, which gets these arguments too."""
    if not (SUITE / "conftest.py").is_file():
        raise UsageError(
            "bench: the benchmarks come with the source distribution and the repository, not with an installed "
            'package. In a folder that has them: pip install -e ".[bench]" && python -m pytest benchmarks'
        )
    if importlib.util.find_spec("pytest_benchmark") is None:
        raise UsageError(f'bench: needs pytest-benchmark: pip install -e "{SUITE.parent}[bench]"')
    # The guards beside them hold bounds for changes of the code: they measure nothing that a user would ask for.
    command = [sys.executable, "-m", "pytest", str(SUITE), f"--ignore={SUITE / 'guards'}", *arguments]
    with subprocess.Popen(command) as running:
        try:
            with contextlib.suppress(KeyboardInterrupt):  # it comes to both, and pytest sums up what it has
                running.wait()
            return running.wait()
        finally:
            running.terminate()

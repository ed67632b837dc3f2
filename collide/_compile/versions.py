"""The versions of Numba and NumPy that the tests pass on; others are refused, as what is private may change in any."""

from __future__ import annotations

import re

# From the first on, below the second: as in pyproject.toml. Before 0.62 Numba's LLVM lacks vector.compress, and NumPy
# before 2.1 the reshape that refuses to copy.
NUMBA, NUMPY = ("0.62", "0.69"), ("2.1", "2.6")


def check() -> None:
    import numpy  # and Numba only then: it has a word of its own on a NumPy that is too new for it

    _refuse_others("NumPy", numpy.__version__, NUMPY)
    import numba

    _refuse_others("Numba", numba.__version__, NUMBA)


def _refuse_others(name: str, version: str, supported: tuple[str, str]) -> None:
    low, high = supported
    if not _numbers(low) <= _numbers(version) < _numbers(high):
        raise ImportError(f"collide needs {name} >= {low} and < {high}, and here is {version}")


def _numbers(version: str) -> list[int]:
    """The first two numbers of a version."""
    return [int(number) for number in re.findall(r"\d+", version)[:2]]

"""A plain copy of a folder of pairs, with four more columns: as many bytes as `collide resolve` moves."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import make_pairs
import numpy as np

from .missing import MissingError

ROWS = 1 << 17


def table(source: Path, target: Path) -> Callable[[], None]:
    """A chunk of each column after the other; four go out twice."""
    if source.suffix:
        raise MissingError("measured on folders only")

    def copy() -> None:
        target.mkdir()
        columns = [np.load(source / f"{name}.npy", mmap_mode="r") for name in make_pairs.NAMES]
        files = [(target / f"{name}.npy").open("wb") for name in (*make_pairs.NAMES, *make_pairs.RESULTS)]
        for start in range(0, columns[0].size, ROWS):
            for column, file in zip([*columns, *columns[2:6]], files, strict=True):
                file.write(column[start : start + ROWS].data)
        for file in files:
            file.close()

    return copy

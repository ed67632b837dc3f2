"""Writes random pairs in the plane, of any number: python benchmarks/make_pairs.py 100000000 pairs.parquet

By its suffix a Parquet file, not compressed, of eight float64 columns; without one, a folder of .npy columns.
"""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

NAMES = ("m1", "m2", "v1x", "v1y", "v2x", "v2y", "nx", "ny")
RESULTS = ("u1x", "u1y", "u2x", "u2y")
ROWS = 1 << 20  # of a row group, pyarrow's usual number


def blocks(n: int) -> Iterator[list[Any]]:
    rng = np.random.default_rng(0)
    for start in range(0, n, ROWS):
        rows = min(ROWS, n - start)
        yield [*rng.uniform(0.1, 10.0, (2, rows)), *rng.normal(size=(6, rows))]


def parquet(n: int, path: Path) -> None:
    schema = pa.schema([(name, pa.float64()) for name in NAMES])
    with pq.ParquetWriter(path, schema, compression="none", use_dictionary=False) as writer:
        for block in blocks(n):
            writer.write_table(pa.table(block, schema=schema), ROWS)


def folder(n: int, path: Path) -> None:
    path.mkdir()
    with contextlib.ExitStack() as stack:
        files = [stack.enter_context((path / f"{name}.npy").open("wb")) for name in NAMES]
        for file in files:
            np.lib.format.write_array_header_1_0(file, {"descr": "<f8", "fortran_order": False, "shape": (n,)})
        for block in blocks(n):
            for file, column in zip(files, block, strict=True):
                file.write(column.data)


def main(n: int, path: Path) -> None:
    parquet(n, path) if path.suffix == ".parquet" else folder(n, path)


if __name__ == "__main__":
    main(int(sys.argv[1]), Path(sys.argv[2]))

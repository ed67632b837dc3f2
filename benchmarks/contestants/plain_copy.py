"""A plain copy of a table of pairs to the disk, with four more columns: as many bytes as `collide resolve` moves."""

from __future__ import annotations

import os
import shutil
from pathlib import Path

import make_pairs
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

ROWS = 1 << 17
MORE = ("u1x", "u1y", "u2x", "u2y")


def copy(source: Path, target: Path) -> None:
    _folder(source, target) if source.is_dir() else _parquet(source, target)
    _sync(target)


def _parquet(source: Path, target: Path) -> None:
    """What pyarrow alone does; four columns go out twice."""
    file = pq.ParquetFile(source)
    schema = pa.schema([*file.schema_arrow, *(pa.field(name, pa.float64()) for name in MORE)])
    with pq.ParquetWriter(target, schema, compression="none", use_dictionary=False) as writer:
        for batch in file.iter_batches(ROWS):
            writer.write_batch(pa.RecordBatch.from_arrays([*batch.columns, *batch.columns[2:6]], schema=schema))


def _folder(source: Path, target: Path) -> None:
    """Plain, a chunk of each column after the other."""
    target.mkdir()
    columns = [np.load(source / f"{name}.npy", mmap_mode="r") for name in make_pairs.NAMES]
    files = [(target / f"{name}.npy").open("wb") for name in (*make_pairs.NAMES, *MORE)]
    for start in range(0, columns[0].size, ROWS):
        for column, file in zip([*columns, *columns[2:6]], files, strict=True):
            file.write(column[start : start + ROWS].data)
    for file in files:
        file.close()


def _parts(path: Path) -> list[Path]:
    return sorted(path.iterdir()) if path.is_dir() else [path]


def _sync(path: Path) -> None:
    for part in _parts(path):
        handle = os.open(part, os.O_RDONLY)
        os.fsync(handle)
        os.close(handle)


def forget(path: Path) -> None:
    """Asks the system to keep nothing of it in memory."""
    _sync(path)
    for part in _parts(path):
        handle = os.open(part, os.O_RDONLY)
        os.posix_fadvise(handle, 0, 0, os.POSIX_FADV_DONTNEED)
        os.close(handle)


def remove(path: Path) -> None:
    if path.is_dir():
        shutil.rmtree(path)
    else:
        path.unlink(missing_ok=True)

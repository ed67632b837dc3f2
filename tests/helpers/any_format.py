"""Tables in every format that the command line knows, written and read without it, and their columns as NumPy's."""

import csv
import gzip
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa

from tests.helpers import tables

TEXT = {".csv": ",", ".csv.gz": ",", ".tsv": "\t", ".tsv.gz": "\t"}
NUMPY = ("", ".npz")
ARROW = (".parquet", ".arrow", ".arrows", ".feather")
ALL = (*NUMPY, *ARROW, *TEXT)


def suffix_of(path: Path) -> str:
    return "".join(path.suffixes)


def opened(path: Path, mode: str) -> Any:
    return gzip.open(path, mode) if path.suffix == ".gz" else path.open(mode)


def write(path: Path, columns: Mapping[str, Any]) -> Path:
    """Columns as NumPy's, as far as the format can hold them."""
    if suffix_of(path) in TEXT:
        with opened(path, "wb") as file:
            file.write(as_text(columns, TEXT[suffix_of(path)]))
    elif path.suffix == ".npz":
        np.savez(path, **columns)
    elif path.suffix == ".feather":
        tables.write(path.with_suffix(".arrow"), columns).rename(path)
    else:
        tables.write(path, columns)
    return path


def as_text(columns: Mapping[str, Any], delimiter: str = ",", end: str = "\n") -> bytes:
    rows = zip(*(map(str, np.asarray(column).tolist()) for column in columns.values()), strict=True)
    return "".join(delimiter.join(row) + end for row in [columns, *rows]).encode()


def read(path: Path) -> dict[str, Any]:
    """The columns by name, in order but for folders; of text they are strings."""
    suffix = suffix_of(path)
    if suffix in TEXT:
        with opened(path, "rb") as file:
            names, *rows = csv.reader(file.read().decode().splitlines(keepends=True), delimiter=TEXT[suffix])
        return {name: np.array([row[k] for row in rows]) for k, name in enumerate(names)}
    if suffix == ".npz":
        with np.load(path, allow_pickle=False) as archive:
            return {name: archive[name] for name in archive.files}
    if suffix == "":
        return dict(tables.read(path))
    table = pa.ipc.open_file(path).read_all() if suffix == ".feather" else tables.read(path)
    return {name: table[name].to_numpy() for name in table.column_names}

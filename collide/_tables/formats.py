"""The formats of tables: an entry of FORMATS is all that makes one. Any one is written from any other."""

from __future__ import annotations

import functools
import importlib
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

from .._system.signals import interruptible
from .by_name import TableError
from .stream import Sink, Source


class Format(NamedTuple):
    """How tables are read and written. By the names of modules and classes: pyarrow is imported where it is needed."""

    what: str
    module: str
    source: str
    sink: str
    begins: bytes = b""  # how each file begins
    streams: bool = False  # through pipes, too
    options: Mapping[str, Any] = {}  # of both classes

    def load(self) -> tuple[Callable[..., Source], Callable[..., Sink]]:
        """Their classes."""
        with interruptible():
            module = importlib.import_module(f"{__package__}.{self.module}")
        source, sink = (functools.partial(getattr(module, name), **self.options) for name in (self.source, self.sink))
        return source, sink


_ARROW = Format("Arrow's file format", "ipc_files", "Ipc", "IpcSink", b"ARROW1")
_TABS = {"delimiter": "\t"}
_GZIP: Mapping[str, Any] = {"compressed": True}

# By the ends of the names of files, but for folders.
FOLDER = "npy"
FORMATS = {
    FOLDER: Format("a folder of .npy files, one a column", "npy_folders", "Folder", "FolderSink"),
    "npz": Format("NumPy's archives; in memory as a whole", "npz_files", "Archive", "ArchiveSink", b"PK"),
    "parquet": Format("Parquet", "parquet_files", "Parquet", "ParquetSink", b"PAR1"),
    "arrow": _ARROW,
    "arrows": Format("Arrow's format for streams", "ipc_files", "IpcStream", "IpcStreamSink", b"\xff" * 4, True),
    "feather": _ARROW._replace(what="the same as arrow"),
    "csv": Format("values parted by commas, or by --delimiter", "csv_files", "Csv", "CsvSink", streams=True),
    "csv.gz": Format("the same, compressed", "csv_files", "Csv", "CsvSink", b"\x1f\x8b", options=_GZIP),
    "tsv": Format("values parted by tabs", "csv_files", "Csv", "CsvSink", streams=True, options=_TABS),
    "tsv.gz": Format("the same, compressed", "csv_files", "Csv", "CsvSink", b"\x1f\x8b", options={**_TABS, **_GZIP}),
}


def by_suffix(path: Path) -> str | None:
    """The format that the end of a file's name tells of."""
    ends = ("".join(path.suffixes[-2:]), path.suffix)
    return next((end[1:].lower() for end in ends if end[1:].lower() in FORMATS and end.lower() != f".{FOLDER}"), None)


def explained(error: TableError, path: Path, name: str) -> TableError:
    """Why a file cannot be read as one of this format, where how it begins tells more than the error."""
    begins = FORMATS[name].begins
    try:
        with path.open("rb") as file:
            beginning = file.read(8)
    except OSError:
        return error
    if begins and beginning.startswith(begins):
        return error
    other = next((other for other, f in FORMATS.items() if f.begins and beginning.startswith(f.begins)), None)
    said = f"is no .{name} file" if begins else str(error)
    if other:
        return TableError(f"{said}; it begins as a .{other} file does: --from {other}")
    return TableError(f"{said}: --from says what else it is") if begins else error

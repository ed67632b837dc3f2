"""The command line: `collide resolve` for files, `collide demo` to see what this machine does.

Exit status 2: the command line is at fault; 1: the data; 130: interrupted. Either way one line on standard error, and
no output file.
"""

from __future__ import annotations

import argparse
import contextlib
import os
import signal
import sys
import tempfile
import zipfile
import zlib
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import IO, Any

import numpy as np

from ._kernels import CARTESIAN, LINE_FORM, POLAR, Form
from .batch import resolve_1d, resolve_2d, resolve_polar
from .errors import InvalidPairError

Array = np.ndarray[Any, np.dtype[Any]]

_FORMS = {"1d": (LINE_FORM, resolve_1d), "cartesian": (CARTESIAN, resolve_2d), "polar": (POLAR, resolve_polar)}


class DataError(Exception):
    """The data are at fault."""


class UsageError(Exception):
    """The command line is at fault."""


def main(arguments: Sequence[str] | None = None) -> int:
    options = _parser().parse_args(arguments)
    # A termination, too, has to remove the temporary file.
    with contextlib.suppress(ValueError):  # not the main thread
        signal.signal(signal.SIGTERM, lambda *_: sys.exit(143))
    try:
        if options.command == "demo":
            from . import _demo

            _demo.main()
        else:
            resolve(options.input, options.output, options.invalid, options.approaching_only)
    except UsageError as error:
        return _fail(error, 2)
    except (DataError, OSError) as error:
        return _fail(error, 1)
    except KeyboardInterrupt:
        return _fail("interrupted", 130)
    return 0


def _fail(message: object, status: int) -> int:
    print(f"collide: {message}", file=sys.stderr)
    return status


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="collide", description="Elastic collisions of two balls, millions at once.")
    commands = parser.add_subparsers(dest="command", required=True)
    commands.add_parser("demo", help="time ten million random pairs on this machine")
    columns = "; ".join(f"{name}: {' '.join(form.columns[:-1])}" for name, (form, _) in _FORMS.items())
    one = commands.add_parser(
        "resolve",
        help="resolve the pairs in a file",
        description="Writes the columns of INPUT and, after them, the velocities after the collisions.",
        epilog=f"The names of the columns choose the form. {columns}. A column restitution is optional.",
    )
    one.add_argument("input", metavar="INPUT.npz", type=Path)
    one.add_argument("-o", "--output", metavar="OUTPUT.npz", type=Path, required=True)
    one.add_argument("--invalid", choices=("raise", "keep", "nan"), default="raise", help="default: %(default)s")
    one.add_argument("--approaching-only", action="store_true", help="leave pairs that do not approach as they are")
    return parser


def resolve(source: Path, target: Path, invalid: str, approaching_only: bool) -> None:
    """Resolves the pairs of one .npz file into another, which appears whole or not at all."""
    if not source.is_file():
        raise UsageError(f"{source}: no such file")
    try:
        real_target = target.resolve()  # of a link, what it points to
    except (OSError, RuntimeError) as error:
        raise UsageError(f"{target}: {error}") from None
    if real_target.is_symlink():
        raise UsageError(f"{target}: a link that leads to itself")
    if target.exists() and (not target.is_file() or source.samefile(target)):
        raise UsageError(f"{target}: is {'the input' if target.is_file() else 'not a file'}")
    if not real_target.parent.is_dir():
        raise UsageError(f"{real_target.parent}: no such folder")
    table = _read(source)
    form, function = _choose(source, table)
    columns = _columns(source, table, form)
    try:
        results = function(**columns, invalid=invalid, approaching_only=approaching_only)
    except InvalidPairError as error:
        row = error.index[0] if error.index else 0
        others = f" ({error.count} invalid pairs in all)" if error.count > 1 else ""
        raise DataError(f"{source}: row {row}: {error.reason}{others}") from None
    except (TypeError, ValueError, MemoryError) as error:
        raise DataError(f"{source}: {error or 'out of memory'}") from None
    with _replacing(real_target) as file:
        _write(file, {**table, **dict(zip(form.outputs, results, strict=True))})


def _read(path: Path) -> dict[str, Array]:
    name = ""
    try:
        with path.open("rb") as file:
            archive = np.load(file, allow_pickle=False)
            if not isinstance(archive, np.lib.npyio.NpzFile):
                raise DataError(f"{path}: is no .npz file")
            table = {}
            for name in archive.files:
                table[name] = archive[name]
                if not isinstance(table[name], np.ndarray):
                    raise ValueError("not an array")
            return table
    # What zipfile and NumPy raise for damage, encryption, methods unknown to them, pickles and sizes out of reach.
    except (
        OSError,
        ValueError,
        EOFError,
        KeyError,
        RuntimeError,
        MemoryError,
        zipfile.BadZipFile,
        zlib.error,
    ) as error:
        column = f" column {name}:" if name else ""
        why = " ".join(str(error).split()) or type(error).__name__
        raise DataError(f"{path}:{column} cannot be read as a .npz file of plain arrays ({why})") from None


def _write(file: IO[bytes], table: Mapping[str, Array]) -> None:
    """numpy.savez, but for the columns that are named as its own arguments."""
    with zipfile.ZipFile(file, "w", zipfile.ZIP_STORED, allowZip64=True) as archive:
        for name, column in table.items():
            with archive.open(f"{name}.npy", "w", force_zip64=True) as member:
                np.lib.format.write_array(member, np.asanyarray(column), allow_pickle=False)


def _choose(path: Path, table: Mapping[str, Array]) -> tuple[Form, Any]:
    """The form whose columns are all there; else the missing columns of the nearest form."""
    missing = {name: [c for c in form.columns[:-1] if c not in table] for name, (form, _) in _FORMS.items()}
    complete = [name for name, columns in missing.items() if not columns]
    # The polar form has all columns of the form on a line.
    if complete == ["1d", "polar"]:
        complete = ["polar"]
    if len(complete) > 1:
        raise DataError(f"{path}: has the columns of more than one form: {', '.join(complete)}")
    if not complete:
        own = {"1d": (), "cartesian": ("v1x", "v1y", "v2x", "v2y", "nx", "ny"), "polar": ("theta1", "theta2", "phi")}
        likely = max(_FORMS, key=lambda name: (sum(c in table for c in own[name]), -len(missing[name])))
        raise DataError(f"{path}: missing column {', '.join(missing[likely])} (of the {likely} form)")
    form, function = _FORMS[complete[0]]
    taken = [name for name in form.outputs if name in table]
    if taken:
        raise DataError(f"{path}: column {taken[0]}: is there already, and would be written")
    return form, function


def _columns(path: Path, table: Mapping[str, Array], form: Form) -> dict[str, Array]:
    columns = {name: table[name] for name in form.columns if name in table}
    length = next((c.shape[0] for c in columns.values() if c.ndim == 1), None)
    for name, column in columns.items():
        if column.ndim > 1:
            raise DataError(f"{path}: column {name}: has {column.ndim} dimensions, must have 1")
        if column.ndim == 1 and column.shape[0] != length:
            first = next(n for n, c in columns.items() if c.ndim == 1)
            rows = min(column.shape[0], length or 0)
            raise DataError(
                f"{path}: column {name}: has {column.shape[0]} rows where {first} has {length}; they part at row {rows}"
            )
        if column.dtype.kind not in "biuf" or column.dtype.itemsize > 8:
            raise DataError(f"{path}: column {name}: has dtype {column.dtype}, must be a real number")
    return columns


@contextlib.contextmanager
def _replacing(path: Path) -> Iterator[IO[bytes]]:
    """A file to write to that takes the place of `path` when all is written, and vanishes on any error."""
    handle, name = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.", suffix=".tmp")
    temporary = Path(name)
    try:
        with os.fdopen(handle, "wb") as file:
            yield file
            file.flush()
            os.fsync(file.fileno())
        mask = os.umask(0)
        os.umask(mask)
        temporary.chmod(path.stat().st_mode & 0o777 if path.exists() else 0o666 & ~mask)
        temporary.replace(path)
    except BaseException:
        temporary.unlink(missing_ok=True)  # gone if the interrupt came after the renaming
        raise


if __name__ == "__main__":
    sys.exit(main())

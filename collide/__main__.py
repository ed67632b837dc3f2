"""The command line: `collide resolve` for files, `collide demo` to see what this machine does.

Exit status 2: the command line is at fault; 1: the data; 130: interrupted. Either way no output file, and one line on
standard error (argparse puts its usage before that).
"""

from __future__ import annotations

import argparse
import contextlib
import importlib.util
import os
import signal
import sys
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

from . import _numpy_files, _stream, _tables

# By the names of the classes in _arrow_files, which needs pyarrow.
_SUFFIXES = {
    ".npz": "Archive",
    ".parquet": "Parquet",
    ".arrow": "Ipc",
    ".arrows": "IpcStream",
    ".feather": "Ipc",
    ".csv": "Csv",
}
_KNOWN = f"a folder of .npy files, or one of {', '.join(_SUFFIXES)}"


class UsageError(Exception):
    """The command line is at fault."""


def main(arguments: Sequence[str] | None = None) -> int:
    options = _parser().parse_args(arguments)
    # A termination, too, has to remove the temporary file, and so has a terminal that is closed.
    for number in (signal.SIGTERM, signal.SIGHUP):
        if signal.getsignal(number) == signal.SIG_DFL:
            with contextlib.suppress(ValueError):  # not the main thread
                signal.signal(number, lambda number, _: sys.exit(128 + number))
    try:
        if options.command == "demo":
            from . import _demo

            _demo.main()
        else:
            resolve(options)
    except UsageError as error:
        return _fail(error, 2)
    except _tables.TableError as error:
        return _fail(f"{options.input}: {error}", 1)
    except MemoryError as error:
        return _fail(f"{options.input}: {error or 'out of memory'}", 1)
    except OSError as error:
        return _fail(f"{options.output}: {os.strerror(error.errno) if error.errno else error}", 1)
    except KeyboardInterrupt:
        return _fail("interrupted", 130)
    return 0


def _fail(message: object, status: int) -> int:
    print(f"collide: {' '.join(str(message).splitlines())}", file=sys.stderr)
    return status


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="collide", description="Elastic collisions of two balls, millions at once.")
    commands = parser.add_subparsers(dest="command", required=True)
    commands.add_parser("demo", help="time ten million random pairs on this machine")
    columns = "; ".join(f"{name}: {' '.join(form.columns[:-1])}" for name, form in _tables.FORMS.items())
    one = commands.add_parser(
        "resolve",
        help="resolve the pairs in a file",
        description="Writes the columns of INPUT and, after them, the velocities after the collisions. INPUT may be "
        f"{_KNOWN}; OUTPUT is the same. All but .npz may be larger than memory.",
        epilog=f"The names of the columns choose the form. {columns}. A column restitution is optional.",
    )
    one.add_argument("input", metavar="INPUT", type=Path)
    one.add_argument("-o", "--output", metavar="OUTPUT", type=Path, required=True)
    one.add_argument("--form", choices=tuple(_tables.FORMS), help="default: the one whose columns are there")
    one.add_argument(
        "--columns",
        metavar="m1=NAME,...",
        type=_names,
        default={},
        help="the names of columns that are called otherwise, written ones (u1x, ...) too",
    )
    one.add_argument("--restitution", metavar="E", type=float, help="for all pairs; default: the column, or 1")
    one.add_argument("--invalid", choices=("raise", "keep", "nan"), default="raise", help="default: %(default)s")
    one.add_argument("--approaching-only", action="store_true", help="leave pairs that do not approach as they are")
    one.add_argument("--quiet", action="store_true", help="no progress bar, no report")
    return parser


def _names(text: str) -> dict[str, str]:
    """m1=a,m2=b as a dictionary."""
    pairs = [part.partition("=") for part in text.split(",")]
    if not all(name and column for name, _, column in pairs) or len({name for name, _, _ in pairs}) < len(pairs):
        raise argparse.ArgumentTypeError(f"{text!r}: must be NAME=COLUMN,NAME=COLUMN,...")
    return {name: column for name, _, column in pairs}


def resolve(options: argparse.Namespace) -> None:
    """Resolves the pairs of one file into another, which appears whole or not at all."""
    kind = _kind(options.input)
    target = _checked(options.input, options.output, kind)
    source = kind(options.input)
    try:
        how = _tables.options(options.restitution, options.approaching_only, options.invalid)
        columns = _tables.choose(source.names, options.form, options.columns, how)
    except _tables.TableError:
        raise
    except ValueError as error:
        raise UsageError(error) from None
    with _bar(options.quiet) as progress:
        report = _stream.resolve(source, target, columns, how, progress)
    if not options.quiet:
        _say(_sentence(report))


def _kind(path: Path) -> Callable[[Path], _stream.Source]:
    """The format of an input."""
    try:
        if path.is_dir():
            return _numpy_files.Folder
        if not path.is_file():
            raise UsageError(f"{path}: {'is not a file' if path.exists() else 'no such file'}")
    except OSError as error:
        raise UsageError(f"{path}: {error.strerror}") from None
    name = _SUFFIXES.get(path.suffix.lower())
    if name is None:
        raise UsageError(f"{path}: must be {_KNOWN}")
    if name == "Archive":
        return _numpy_files.Archive
    try:
        from . import _arrow_files
    except ImportError:
        raise UsageError(f"{path}: needs pyarrow: pip install pyarrow") from None
    return getattr(_arrow_files, name)  # type: ignore[no-any-return]


def _checked(source: Path, target: Path, kind: Any) -> Path:
    """Where to write: of a link, what it points to."""
    try:
        real = target.resolve()
    except (OSError, RuntimeError) as error:
        raise UsageError(f"{target}: {error}") from None
    if real.is_symlink():
        raise UsageError(f"{target}: a link that leads to itself")
    if not real.parent.is_dir():
        raise UsageError(f"{real.parent}: no such folder")
    if target.exists() and source.samefile(target):
        raise UsageError(f"{target}: is the input")
    if kind.is_folder:
        # A folder is replaced whole: nothing else may get lost with it.
        if target.exists() and not (target.is_dir() and all(map(_is_column, target.iterdir()))):
            raise UsageError(f"{target}: is there, and not a folder of .npy files only")
    elif target.exists() and not target.is_file():
        raise UsageError(f"{target}: is not a file")
    elif _SUFFIXES.get(target.suffix.lower()) != _SUFFIXES[source.suffix.lower()]:
        raise UsageError(f"{target}: must have the format of the input, {source.suffix}")
    return real


def _is_column(file: Path) -> bool:
    return file.suffix == ".npy" and file.is_file()


def _say(line: str) -> None:
    """On standard output, which may be full or gone: the work is done all the same."""
    try:
        print(line, flush=True)
    except OSError as error:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())  # or Python complains once more at its end
        _fail(f"standard output: {error.strerror}", 0)


@contextlib.contextmanager
def _bar(quiet: bool) -> Iterator[Callable[[int, int | None], None]]:
    """What shows progress on a terminal, if tqdm is there."""
    shown = not quiet and sys.stderr is not None and sys.stderr.isatty()
    if not shown or importlib.util.find_spec("tqdm") is None:
        yield lambda n_rows, n_all: None
        return
    from tqdm import tqdm

    with tqdm(unit=" rows", unit_scale=True) as bar:

        def progress(n_rows: int, n_all: int | None) -> None:
            bar.total = n_all
            bar.update(n_rows)

        yield progress


def _sentence(report: _stream.Report) -> str:
    kept = report.conservation
    left_out = kept.n_pairs - kept.n_counted
    return (
        f"{kept.n_pairs:,} pairs, {report.n_invalid:,} of them invalid; relative change of total momentum "
        f"{kept.momentum:.1e}, of total energy {kept.energy:.1e}"
        + (f" ({left_out:,} pairs without a finite energy not counted)" if left_out else "")
    )


if __name__ == "__main__":
    sys.exit(main())

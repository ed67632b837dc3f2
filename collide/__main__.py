"""The command line: `collide resolve` for files, `collide demo` to see what this machine does, `collide compile` for
all kernels ahead, `collide bench` for the benchmarks.

Exit status 2: the command line is at fault; 1: the data, or what is written; 130: interrupted. Either way there is no
new output, and one line on standard error (argparse puts its usage before that).
"""

from __future__ import annotations

import argparse
import atexit
import contextlib
import gc
import importlib.util
import os
import re
import sys
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any, NoReturn

from ._system.messages import reason, system
from ._system.signals import THE_COMMAND, ending, interruptible

with interruptible():
    import numba
    import numpy as np

    from . import __version__
    from ._pairs.forms import COLLISIONS
    from ._tables import by_name, numpy_files, replacement, stream

# By the modules and the names of classes: pyarrow is imported where it is needed.
_SUFFIXES = {
    ".npz": "numpy_files.Archive",
    ".parquet": "parquet_files.Parquet",
    ".arrow": "ipc_files.Ipc",
    ".arrows": "ipc_files.IpcStream",
    ".feather": "ipc_files.Ipc",
    ".csv": "csv_files.Csv",
}
_KNOWN = f"a folder of .npy files, or one of {', '.join(_SUFFIXES)}"


if THE_COMMAND:
    # With the process all its memory goes: to look for garbage among Numba's many objects would take 0.1 s more.
    atexit.register(gc.freeze)


class UsageError(Exception):
    """The command line is at fault."""


class _Parser(argparse.ArgumentParser):
    """Says where help is, if the command line is at fault."""

    def error(self, message: str) -> NoReturn:
        super().error(f"{message}; {self.prog} --help shows what there is")


def main(arguments: Sequence[str] | None = None) -> int:
    try:
        return _run(_parsed(arguments))
    except KeyboardInterrupt:
        return _fail("interrupted", 130)


def _run(options: argparse.Namespace) -> int:
    """The exit status."""
    try:
        with ending():
            options.run(options)
    except UsageError as error:
        return _fail(error, 2)
    except by_name.TableError as error:
        return _fail(f"{options.input}: {error}", 1)
    except MemoryError as error:
        return _fail(f"{options.input}: {str(error) or 'out of memory'}", 1)
    except OSError as error:
        return _fail(f"{options.output}: {reason(error)}", 1)
    except RuntimeError as error:
        if not numba.config.DISABLE_JIT:  # without which there is none
            raise
        return _fail(error, 1)
    return 0


def _fail(message: object, status: int) -> int:
    """In one line. Bytes of a name that are no text stand in it as \\xe9."""
    line = re.sub("[\udc80-\udcff]", lambda byte: f"\\x{ord(byte[0]) - 0xDC00:x}", " ".join(str(message).splitlines()))
    print(f"collide: {line}", file=sys.stderr)
    return status


def _parsed(arguments: Sequence[str] | None) -> argparse.Namespace:
    """What `bench` does not know is for pytest."""
    parser = _parser()
    options, rest = parser.parse_known_args(arguments)
    if rest and options.command != "bench":
        parser.error(f"unrecognized arguments: {' '.join(rest)}")
    options.rest = rest
    return options


_EXAMPLES = """\
examples:
  collide demo                                  half a minute: what this machine does
  collide resolve pairs.csv -o after.csv        the columns of a file, and the velocities after the collisions
"""


def _parser() -> argparse.ArgumentParser:
    parser = _Parser(
        prog="collide",
        description="Elastic collisions of two balls, millions at once.",
        epilog=_EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--version", action=_Version, nargs=0, help="what runs here, for a report")
    commands = parser.add_subparsers(dest="command", metavar="COMMAND", required=True)
    text = "time millions of random pairs against NumPy and the memory of this machine, in half a minute"
    demo = commands.add_parser("demo", help=text, description=text)
    demo.set_defaults(run=_demonstrate, input="demo", output="demo")
    columns = "; ".join(f"{name}: {' '.join(form.columns[:-1])}" for name, form in COLLISIONS.items())
    one = commands.add_parser(
        "resolve",
        help="resolve the pairs in a file",
        description="Writes the columns of INPUT and, after them, the velocities after the collisions. INPUT may be "
        f"{_KNOWN}; OUTPUT is the same. All but .npz may be larger than memory.",
        epilog=f"The names of the columns choose the form. {columns}. A column restitution is optional.",
    )
    one.set_defaults(run=resolve_file)
    one.add_argument("input", metavar="INPUT", type=Path)
    one.add_argument("-o", "--output", metavar="OUTPUT", type=Path, required=True)
    one.add_argument("--overwrite", action="store_true", help="replace OUTPUT if it is there")
    one.add_argument("--form", choices=tuple(COLLISIONS), help="default: the one whose columns are there")
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
    ahead = commands.add_parser(
        "compile",
        help="compile all kernels ahead, as for an image of a container",
        description="Compiles all kernels, and keeps them where each first call would: beside the package, else in the "
        "user's folder of caches; in NUMBA_CACHE_DIR alone if that is set. They serve this version of the package, "
        "Python and Numba, on this kind of processor, and, where root has made them, every user.",
    )
    ahead.set_defaults(run=_compile, input="compile", output="compile")
    bench = commands.add_parser(
        "bench",
        help="run the benchmarks, which come with the sources",
        usage="%(prog)s [-h] [ARGUMENT OF PYTEST ...]",
        description="Runs the measurements in the folder benchmarks by pytest, where the package is installed from its "
        "sources, by pip install -e. All of them take long: -k chooses some.",
        epilog="collide bench -k 2d runs those in the plane only.",
    )
    bench.set_defaults(run=_bench, input="bench", output="bench")
    return parser


class _Version(argparse.Action):
    """Says what runs here, and ends."""

    def __call__(self, parser: argparse.ArgumentParser, *rest: Any) -> None:
        python = ".".join(map(str, sys.version_info[:3]))
        found = f"collide {__version__}, Numba {numba.__version__}, NumPy {np.__version__}, Python {python}"
        print(f"{found}, {system()}")
        parser.exit()


def _names(text: str) -> dict[str, str]:
    """m1=a,m2=b as a dictionary."""
    pairs = [part.partition("=") for part in text.split(",")]
    if not all(name and column for name, _, column in pairs) or len({name for name, _, _ in pairs}) < len(pairs):
        raise argparse.ArgumentTypeError(f"{text!r}: must be NAME=COLUMN,NAME=COLUMN,...")
    return {name: column for name, _, column in pairs}


def _demonstrate(options: argparse.Namespace) -> None:
    with interruptible():
        from ._cli import demo
    try:
        demo.main()
        print(end="", flush=True)
    except OSError:
        _give_up_output()
        raise


def _compile(options: argparse.Namespace) -> None:
    with interruptible():
        from ._cli import kernels
    _say(kernels.main())


def _bench(options: argparse.Namespace) -> None:
    with interruptible():
        from ._cli import bench
    try:
        sys.exit(bench.main(options.rest))
    except bench.MissingError as error:
        raise UsageError(error) from None


def resolve_file(options: argparse.Namespace) -> None:
    """Resolves the pairs of one file into another, which appears whole or not at all."""
    kind = _kind(options.input)
    target = _checked(options.input, options.output, kind, options.overwrite)
    with contextlib.closing(kind(options.input)) as source:
        try:
            how = by_name.options(options.restitution, options.approaching_only, options.invalid)
            columns = by_name.choose(source.names, options.form, options.columns, how)
            for name in columns.outputs:
                if not source.is_folder and name.encode(errors="ignore").decode() != name:
                    raise ValueError(f"--columns: {name!r}: must be Unicode text, except in a folder")
        except by_name.TableError:
            raise
        except ValueError as error:
            raise UsageError(error) from None
        with _bar(options.quiet) as progress:
            report = stream.run(source, target, options.overwrite, columns, how, progress)
    if not options.quiet:
        _say(_sentence(report))


def _kind(path: Path) -> Callable[[Path], stream.Source]:
    """The format of an input."""
    try:
        if path.is_dir():
            return numpy_files.Folder
        if not path.is_file():
            raise UsageError(f"{path}: {'is not a file' if path.exists() else 'no such file'}")
    except OSError as error:
        raise UsageError(f"{path}: {error.strerror}") from None
    module, _, name = _SUFFIXES.get(path.suffix.lower(), "").partition(".")
    if not name:
        raise UsageError(f"{path}: must be {_KNOWN}")
    try:
        with interruptible():
            return getattr(importlib.import_module(f"._tables.{module}", __package__), name)  # type: ignore[no-any-return]
    except ImportError:
        raise UsageError(f"{path}: needs pyarrow: pip install pyarrow") from None


def _checked(source: Path, target: Path, kind: Any, overwrite: bool) -> Path:
    """Where to write: of a link, what it points to. Of what is there, nothing that is not meant may get lost."""
    try:
        real = target.resolve()
        is_there = os.path.lexists(target)
    except (OSError, RuntimeError) as error:
        raise UsageError(f"{target}: {error}") from None
    if real.is_symlink():
        raise UsageError(f"{target}: a link that leads to itself")
    if not real.parent.is_dir():
        raise UsageError(f"{real.parent}: no such folder")
    if target.exists() and source.samefile(target):
        raise UsageError(f"{target}: is the input")
    suffix = target.suffix.lower()
    if kind.is_folder:
        if _lies_in(real, source):
            raise UsageError(f"{target}: lies in the input")
        if is_there and any(_lies_in(part, real) for part in (source, *source.iterdir())):
            raise UsageError(f"{target}: the input lies in it")
        if suffix in _SUFFIXES:
            raise UsageError(f"{target}: must be the name of a folder, as the input is one, and not of a {suffix} file")
        if target.exists() and not replacement.columns_only(target):
            raise UsageError(
                f"{target}: is there, and not a folder of .npy files only, which --overwrite would replace"
            )
    elif target.exists() and not target.is_file():
        raise UsageError(f"{target}: is there, and is not a file, which --overwrite would replace")
    elif _SUFFIXES.get(suffix) != _SUFFIXES[source.suffix.lower()]:
        raise UsageError(f"{target}: must have the format of the input, {source.suffix}")
    if is_there and not overwrite:
        raise UsageError(f"{target}: is there already; --overwrite replaces it")
    return real


def _lies_in(path: Path, folder: Path) -> bool:
    """Links followed."""
    return folder.exists() and any(parent.samefile(folder) for parent in Path(os.path.realpath(path)).parents)


def _say(line: str) -> None:
    """On standard output, which may be full or gone: the work is done all the same."""
    try:
        print(line, flush=True)
    except OSError as error:
        _give_up_output()
        _fail(f"standard output: {error.strerror}", 0)


def _give_up_output() -> None:
    """If it cannot be written, or Python complains once more at its end."""
    try:
        print(end="", flush=True)
    except OSError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


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


def _sentence(report: stream.Report) -> str:
    kept = report.conservation
    left_out = kept.n_pairs - kept.n_counted
    return (
        f"{by_name.counted(kept.n_pairs, 'pair')}, {report.n_invalid:,} of them invalid; "
        f"relative change of total momentum {kept.momentum:.1e}, of total energy {kept.energy:.1e}"
        + (f" ({by_name.counted(left_out, 'pair')} without a finite energy not counted)" if left_out else "")
    )


if __name__ == "__main__":
    sys.exit(main())

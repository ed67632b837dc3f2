"""`collide resolve`: the pairs of a file or of standard input, resolved into another one or to standard output."""

from __future__ import annotations

import argparse
import contextlib
import functools
import importlib.util
import os
import sys
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

from .._pairs.forms import COLLISIONS
from .._system.messages import reason
from .._tables import by_name, formats, replacement, standard, stream
from .._tables.formats import FOLDER, FORMATS
from .messages import STANDARD, UsageError, say

_KNOWN = f"a folder of .npy files, or one of {', '.join(f'.{name}' for name in FORMATS if name != FOLDER)}"
_DELIMITED = {"csv", "csv.gz"}
_STREAMS = ", ".join(name for name, known in FORMATS.items() if known.streams)


def add_to(commands: Any) -> None:
    """Adds the subcommand to those of a parser."""
    parser = commands.add_parser(
        "resolve",
        help="resolve the pairs in a file",
        formatter_class=argparse.RawDescriptionHelpFormatter,
        description="Writes the columns of INPUT and, after them, the velocities after the collisions.",
        epilog=_epilog(),
    )
    parser.set_defaults(run=resolve)
    parser.add_argument(
        "input", metavar="INPUT", type=_place, help="a file, a folder of .npy files, or - for standard input"
    )
    parser.add_argument(
        "-o", "--output", metavar="OUTPUT", type=_place, required=True, help="a file or a folder; - for standard output"
    )
    parser.add_argument("--overwrite", action="store_true", help="replace OUTPUT if it is there")
    files = parser.add_argument_group("formats")
    names = {"metavar": "FORMAT", "choices": tuple(FORMATS)}
    files.add_argument("--from", dest="source", **names, help="of INPUT; default: by the end of its name")
    files.add_argument(
        "--to",
        dest="sink",
        **names,
        help="of OUTPUT; default: by the end of its name, a folder if it has none; of - as INPUT",
    )
    files.add_argument(
        "--delimiter",
        metavar="MARK",
        type=_mark,
        help="what parts the values of .csv text, read and written, as in --delimiter ';'; \\t or tab: a tab",
    )
    pairs = parser.add_argument_group("pairs")
    pairs.add_argument("--form", choices=tuple(COLLISIONS), help="default: the one whose columns are there")
    pairs.add_argument(
        "--columns",
        metavar="m1=NAME,...",
        type=_names,
        default={},
        help="the names of columns that are called otherwise, written ones (u1x, ...) too",
    )
    pairs.add_argument("--restitution", metavar="E", type=float, help="for all pairs; default: the column, or 1")
    pairs.add_argument(
        "--invalid",
        choices=("raise", "keep", "nan"),
        default="raise",
        help="pairs that cannot collide: an error, their velocities before, or NaN; default: %(default)s",
    )
    pairs.add_argument("--approaching-only", action="store_true", help="leave pairs that do not approach as they are")
    parser.add_argument("--quiet", action="store_true", help="no progress bar, no report")


def _epilog() -> str:
    width = max(map(len, FORMATS))
    all_formats = "\n".join(f"  {name:{width}}  {known.what}" for name, known in FORMATS.items())
    all_forms = "\n".join(f"  {name:{width}}  {' '.join(form.columns[:-1])}" for name, form in COLLISIONS.items())
    return f"""\
formats, which the end of a name tells; INPUT and OUTPUT may have different ones:
{all_formats}

All but npz may be larger than memory. {_STREAMS} go through - as well.
Other columns are kept. Those of CSV text stay as they stand, and are strings in
other formats; decimal commas are not taken. What a format cannot hold is an error.
Rows are counted from 0 in what is said of them; the line in a file is said as well.

forms, which the names of the columns choose; a column restitution is optional:
{all_forms}

A file OUTPUT appears whole or not at all. Standard output cannot: after an error,
of which the status tells, part of it has been written.

examples:
  collide resolve pairs.csv -o resolved.parquet --columns m1=mass_a,m2=mass_b
  zcat pairs.tsv.gz | collide resolve - --from tsv -o - | head
"""


def _place(text: str) -> Path:
    return STANDARD if text == "-" else Path(text)


def _mark(text: str) -> str:
    """What parts the values of a line."""
    mark = {"\\t": "\t", "tab": "\t"}.get(text, text)
    if len(mark) != 1 or not mark.isascii() or mark.isalnum() or mark in '"\r\n+-.\0':
        raise argparse.ArgumentTypeError(f"{text!r}: must be one mark that is in no number, as ';', or tab")
    return mark


def _names(text: str) -> dict[str, str]:
    """m1=a,m2=b as a dictionary."""
    pairs = [part.partition("=") for part in text.split(",")]
    if not all(name and column for name, _, column in pairs) or len({name for name, _, _ in pairs}) < len(pairs):
        raise argparse.ArgumentTypeError(f"{text!r}: must be NAME=COLUMN,NAME=COLUMN,...")
    return {name: column for name, _, column in pairs}


def resolve(options: argparse.Namespace) -> None:
    """Resolves the pairs of one table into another."""
    source_format = _format_of_input(options.input, options.source)
    sink_format = _format_of_output(options.output, options.sink, source_format)
    if options.delimiter and not {source_format, sink_format} & _DELIMITED:
        raise UsageError("--delimiter: neither INPUT nor OUTPUT is .csv text, unless --from csv or --to csv says so")
    target = _target(options.input, options.output, sink_format == FOLDER, options.overwrite)
    new_source, _ = _classes(options.input, source_format, options.delimiter)
    _, new_sink = _classes(options.output, sink_format, options.delimiter)
    with contextlib.closing(_opened(new_source, options.input, source_format)) as source:
        try:
            how = by_name.options(options.restitution, options.approaching_only, options.invalid)
            columns = by_name.choose(source.names, options.form, options.columns, how)
        except by_name.TableError:
            raise
        except ValueError as error:
            raise UsageError(error) from None
        if sink_format != FOLDER:
            _check_text(source.names, columns.outputs)
        try:
            with _bar(options.quiet) as progress:
                report = stream.run(source, new_sink, target, columns, how, progress)
        except by_name.TableError as error:
            where = "" if error.row is None else source.place_of(error.row)
            raise by_name.TableError(f"{error}{where}") from None
    if not options.quiet and options.output is STANDARD:
        print(_sentence(report), file=sys.stderr)
    elif not options.quiet:
        say(_sentence(report))


def _format_of_input(path: Path, asked: str | None) -> str:
    if path is STANDARD:
        if asked is None or not FORMATS[asked].streams:
            raise UsageError(f"standard input: --from must say what comes: one of {_STREAMS}")
        return asked
    try:
        is_folder, is_file, is_there = path.is_dir(), path.is_file(), path.exists()
    except OSError as error:
        raise UsageError(f"{path}: {reason(error)}") from None
    if not is_there:
        raise UsageError(f"{path}: no such file (looked for in {path.absolute().parent})")
    if not (is_folder or is_file):
        raise UsageError(f"{path}: is not a file: from a pipe it is read by - (collide resolve - --from csv < {path})")
    name = asked or (FOLDER if is_folder else formats.by_suffix(path))
    if name is None:
        raise UsageError(f"{path}: must be {_KNOWN}; --from says what a file of another name is")
    if is_folder != (name == FOLDER):
        raise UsageError(f"{path}: is {'a' if is_folder else 'no'} folder: --from must be another format, or left out")
    return name


def _format_of_output(path: Path, asked: str | None, source_format: str) -> str:
    if path is STANDARD:
        if not FORMATS[asked or source_format].streams:
            raise UsageError(f"standard output: --to must say what is wanted: one of {_STREAMS}")
        return asked or source_format
    name = asked or formats.by_suffix(path)
    if name is None and source_format != FOLDER and path.suffix:
        raise UsageError(f"{path}: must be {_KNOWN}; --to says what a file of another name is to be")
    return name or FOLDER


def _classes(
    path: Path, name: str, delimiter: str | None
) -> tuple[Callable[..., stream.Source], Callable[..., stream.Sink]]:
    """What reads and writes a format."""
    try:
        source, sink = FORMATS[name].load()
    except ImportError:
        raise UsageError(f"{path}: needs pyarrow: pip install pyarrow") from None
    mark = {"delimiter": delimiter} if delimiter and name in _DELIMITED else {}
    return functools.partial(source, **mark), functools.partial(sink, **mark)


def _opened(new_source: Callable[..., stream.Source], path: Path, name: str) -> stream.Source:
    if path is STANDARD:
        if sys.stdin is None:
            raise UsageError("standard input: is closed")
        return new_source(standard.Input())
    try:
        return new_source(path)
    except by_name.TableError as error:
        raise formats.explained(error, path, name) from None


def _check_text(names: Sequence[str], outputs: Sequence[str]) -> None:
    """Whether the names are text, which those of files need not be."""
    for name in (*outputs, *names):
        if name.encode(errors="ignore").decode() != name:
            said = f"{name!r}: must be Unicode text, except in a folder"
            raise UsageError(f"--columns: {said}") if name in outputs else by_name.TableError(f"column {said}")


def _target(
    source: Path, target: Path, is_folder: bool, overwrite: bool
) -> contextlib.AbstractContextManager[standard.Place]:
    """Where to write: of a link, what it points to. Of what is there, nothing that is not meant may get lost."""
    if target is STANDARD:
        if sys.stdout is None:
            raise UsageError("standard output: is closed")
        if source is not STANDARD and source.is_file() and _is_standard_output(source):
            raise UsageError("standard output: is the input: OUTPUT must be something else")
        return standard.output()
    try:
        real = target.resolve()
        is_there = os.path.lexists(target)
    except (OSError, RuntimeError) as error:
        raise UsageError(f"{target}: {error}") from None
    if real.is_symlink():
        raise UsageError(f"{target}: a link that leads to itself: OUTPUT must be something else")
    if not real.parent.is_dir():
        raise UsageError(f"{real.parent}: no such folder: it has to be made before")
    if source is not STANDARD:
        _check_apart(source, target, real)
    if is_folder and target.exists() and not replacement.columns_only(target):
        raise UsageError(f"{target}: is there, and not a folder of .npy files only, which --overwrite would replace")
    if not is_folder and target.exists() and not target.is_file():
        raise UsageError(f"{target}: is there, and is not a file, which --overwrite would replace")
    if is_there and not overwrite:
        raise UsageError(f"{target}: is there already; --overwrite replaces it")
    return replacement.output(real, is_folder, overwrite)


def _check_apart(source: Path, target: Path, real: Path) -> None:
    """Whether the input and the output are two, and neither is in the other."""
    if target.exists() and source.samefile(target):
        raise UsageError(f"{target}: is the input: OUTPUT must be something else")
    if _lies_in(real, source):
        raise UsageError(f"{target}: lies in the input: OUTPUT must be somewhere else")
    try:
        parts = (source, *source.iterdir()) if source.is_dir() else (source,)
    except OSError as error:
        raise UsageError(f"{source}: {reason(error)}") from None
    if target.is_dir() and any(_lies_in(part, real) for part in parts):
        raise UsageError(f"{target}: the input lies in it: OUTPUT must be somewhere else")


def _is_standard_output(path: Path) -> bool:
    try:
        return os.path.samestat(os.fstat(sys.stdout.fileno()), path.stat())
    except OSError:  # as of what stands for it in tests
        return False


def _lies_in(path: Path, folder: Path) -> bool:
    """Links followed."""
    return folder.exists() and any(parent.samefile(folder) for parent in Path(os.path.realpath(path)).parents)


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
        + (
            f" ({by_name.counted(left_out, 'pair')}, invalid or without a finite energy, not counted)"
            if left_out
            else ""
        )
    )

"""The command line: `collide resolve` for files, `collide demo` to see what this machine does, `collide compile` for
all kernels ahead, `collide bench` for the benchmarks.

Exit status 2: the command line is at fault; 1: the data, or what is written; 130: interrupted. Either way there is no
new file, and one line on standard error (argparse puts its usage before that). 141, and no line: nobody reads standard
output any more.
"""

from __future__ import annotations

import argparse
import atexit
import gc
import sys
from collections.abc import Sequence
from typing import Any, NoReturn

from ._system.messages import reason, system
from ._system.signals import THE_COMMAND, ending, interruptible

with interruptible():
    import numba
    import numpy as np

    from . import __version__
    from ._cli import resolve
    from ._cli.messages import UsageError, fail, give_up_output, named, say
    from ._tables import by_name

# Standard output goes where nobody reads it: what a shell says of a command that SIGPIPE has ended.
_NOBODY_READS = 141

_EXAMPLES = """\
examples:
  collide demo                                  half a minute: what this machine does
  collide resolve pairs.csv -o after.parquet    the columns of a file, and the velocities after the collisions
"""

if THE_COMMAND:
    # With the process all its memory goes: to look for garbage among Numba's many objects would take 0.1 s more.
    atexit.register(gc.freeze)


class _Parser(argparse.ArgumentParser):
    """Says where help is, if the command line is at fault."""

    def error(self, message: str) -> NoReturn:
        super().error(f"{message}; {self.prog} --help shows what there is")


def main(arguments: Sequence[str] | None = None) -> int:
    try:
        return _run(_parsed(arguments))
    except KeyboardInterrupt:
        return fail("interrupted", 130)


def _run(options: argparse.Namespace) -> int:
    """The exit status."""
    try:
        with ending():
            options.run(options)
    except UsageError as error:
        return fail(error, 2)
    except by_name.TableError as error:
        return fail(f"{named(options.input, 'standard input')}: {error}", 1)
    except MemoryError as error:
        return fail(f"{named(options.input, 'standard input')}: {str(error) or 'out of memory'}", 1)
    except BrokenPipeError:
        give_up_output()
        return _NOBODY_READS
    except OSError as error:
        return fail(f"{named(options.output, 'standard output')}: {reason(error)}", 1)
    except RuntimeError as error:
        if not numba.config.DISABLE_JIT:  # without which there is none
            raise
        return fail(error, 1)
    return 0


def _parsed(arguments: Sequence[str] | None) -> argparse.Namespace:
    """What `bench` does not know is for pytest."""
    parser = _parser()
    options, rest = parser.parse_known_args(arguments)
    if rest and options.command != "bench":
        parser.error(f"unrecognized arguments: {' '.join(rest)}")
    options.rest = rest
    return options


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
    resolve.add_to(commands)
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


def _demonstrate(options: argparse.Namespace) -> None:
    with interruptible():
        from ._cli import demo
    try:
        demo.main()
        print(end="", flush=True)
    except OSError:
        give_up_output()
        raise


def _compile(options: argparse.Namespace) -> None:
    with interruptible():
        from ._cli import kernels
    say(kernels.main())


def _bench(options: argparse.Namespace) -> None:
    with interruptible():
        from ._cli import bench
    sys.exit(bench.main(options.rest))


if __name__ == "__main__":
    sys.exit(main())

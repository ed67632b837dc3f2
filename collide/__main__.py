"""The command line: `collide resolve` for files, `collide demo` to see what this machine does.

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
from typing import Any

from ._system.messages import reason, system
from ._system.signals import THE_COMMAND, ending, interruptible

with interruptible():
    import numba
    import numpy as np

    from . import __version__
    from ._cli import resolve
    from ._cli.messages import UsageError, fail, give_up_output, named
    from ._tables import by_name

# Standard output goes where nobody reads it: what a shell says of a command that SIGPIPE has ended.
_NOBODY_READS = 141

_EXAMPLES = """\
examples:
  collide demo
  collide resolve pairs.csv -o resolved.csv
"""

if THE_COMMAND:
    # With the process all its memory goes: to look for garbage among Numba's many objects would take 0.1 s more.
    atexit.register(gc.freeze)


def main(arguments: Sequence[str] | None = None) -> int:
    try:
        return _run(_parser().parse_args(arguments))
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
    return 0


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="collide",
        description="Elastic collisions of two balls, millions at once.",
        epilog=_EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--version", action=_Version, nargs=0, help="what runs here, for a report")
    commands = parser.add_subparsers(dest="command", required=True)
    demo = commands.add_parser("demo", help="time ten million random pairs on this machine")
    demo.set_defaults(run=_demonstrate, input="demo", output="demo")
    resolve.add_to(commands)
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


if __name__ == "__main__":
    sys.exit(main())

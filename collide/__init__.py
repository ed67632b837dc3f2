"""Elastic collisions of two balls, millions at once.

    resolve_1d, resolve_2d, resolve_3d       velocities after the collisions of a batch of pairs
    resolve_polar                            the same from speeds and directions in the plane
    resolve                                  the same for vectors along the last axis of arrays
    impulse_2d, impulse_3d                   the impulses of the collisions
    time_of_impact, time_of_impact_3d        when pairs that move uniformly will touch
    find_contacts, resolve_contacts          which balls of a state touch, and their collisions in order
    resolve_pairs                            collisions of balls by number, each with a normal of its own
    resolve_walls                            balls at the walls of a box
    set_num_threads, get_num_threads         how many threads a large batch may use
    set_spare_memory, get_spare_memory       how much memory of results that have died is kept for the next ones
    InvalidPairError                         what a pair without an answer raises
    scalar                                   the formulas of one pair, for anyone's `@njit` code
    collide.arrow, collide.dask              Arrow tables and Dask arrays; imported when they are asked for
    python -m collide                        files of any size, a demo, all kernels made ahead, the benchmarks

Behind these doors is a room each, whose __init__.py says what it is for and what to change where:

    _formulas    the formulas: a collision in any number of dimensions, the time of impact, exact sums, sine and cosine
    _pairs       batches: the table of forms, their loop, the checks of arguments, the execution of a call
    _contacts    ball states: grids, the search for contacts, their resolution in order
    _tables      columns by name, files of every format block by block, conservation
    _cli         what only the command line needs: the demo and its yardsticks, all kernels made ahead
    _compile     all that knows Numba and LLVM: options, kernels and their cache, lanes, loads and stores
    _system      all that differs by operating system: threads, locks, forks, memory, whose files are whose

The way of a call of `resolve_2d`: batch.py hands its arguments to _pairs/execution.py, which takes fresh arrays for the
results from _compile/kept_memory.py and calls the kernel with the arguments as they lie; others it converts or passes
through blocks, or has _pairs/arguments.py say what is wrong with them. The kernel is that of the form in
_pairs/forms.py, which says what the columns are in the terms of _formulas/collision.py; _compile/kernel.py compiles it
or finds it on disk. A large batch _compile/pieces.py cuts up for the threads of _compile/team.py. In each piece
_pairs/loop.py loads lanes of pairs, calls the formula on them, looks for invalid pairs and stores the results.
errors.py says which rule the first invalid pair breaks.
"""

import importlib
import inspect
import sys
from typing import TYPE_CHECKING, Any

__version__ = "0.2.0"

if sys.byteorder != "little" or sys.maxsize < 2**63 - 1:
    raise ImportError("collide needs a 64-bit, little-endian platform: its kernels look at the bits of a float64")

from ._system.signals import interruptible

with interruptible():
    from ._compile.versions import check as _check_versions

    _check_versions()
    from . import scalar
    from ._compile import options as _options
    from ._compile.kept_memory import get_spare_memory, set_spare_memory
    from ._system.threads import get_num_threads, set_num_threads
    from .batch import (
        impulse_2d,
        impulse_3d,
        resolve,
        resolve_1d,
        resolve_2d,
        resolve_3d,
        resolve_polar,
        time_of_impact,
        time_of_impact_3d,
    )
    from .contacts import find_contacts, resolve_contacts, resolve_pairs, resolve_walls
    from .errors import InvalidPairError

__all__ = [
    "InvalidPairError",
    "__version__",
    "find_contacts",
    "get_num_threads",
    "get_spare_memory",
    "impulse_2d",
    "impulse_3d",
    "resolve",
    "resolve_1d",
    "resolve_2d",
    "resolve_3d",
    "resolve_contacts",
    "resolve_pairs",
    "resolve_polar",
    "resolve_walls",
    "scalar",
    "set_num_threads",
    "set_spare_memory",
    "time_of_impact",
    "time_of_impact_3d",
]

for _name in filter(lambda name: inspect.isfunction(globals()[name]), __all__):
    _one = (
        f"collide.scalar.{_name} takes one pair there, of numbers"
        if hasattr(scalar, _name)
        else "call it from Python; collide.scalar has the formulas of one pair"
    )
    _options.only_outside(globals()[_name], _one)

if TYPE_CHECKING:
    from . import arrow as arrow
    from . import dask as dask
else:

    def __getattr__(name: str) -> Any:
        if name in ("arrow", "dask"):  # which need more than NumPy and Numba
            return importlib.import_module(f".{name}", __name__)
        raise AttributeError(f"module 'collide' has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted(__all__)  # what is imported on demand may not be there: help() asks for all that it finds here

"""Vectors are tuples of their components: what a formula does to each component of some, it writes once.

Numba makes no tuples in loops. So the loop over components is unrolled here, where their number is known.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from numba import types
from numba.core import cgutils

from .options import compiles, intrinsic


def each(function: Callable[..., Any], *operands: Any) -> Any:
    """(function(x1, y1, ...), function(x2, y2, ...), ...) of tuples; a number serves every component."""
    n = next(len(x) for x in operands if isinstance(x, tuple))
    return tuple(function(*(x[c] if isinstance(x, tuple) else x for x in operands)) for c in range(n))


@compiles(each)
def _each(function: Any, *operands: Any) -> Any:
    n = next(len(x) for x in operands if isinstance(x, types.BaseTuple))
    if n == 1:
        return lambda function, *operands: (function(*_part(operands, 0)),)
    return lambda function, *operands: (function(*_part(operands, 0)), *each(function, *_part(operands, 1)))


@intrinsic
def _part(typingctx: Any, operands: Any, which: Any) -> Any:
    """The first component of each tuple among the operands, or those that follow it; the others as they are."""
    if not isinstance(which, types.IntegerLiteral):
        return None
    the_first = which.literal_value == 0
    parts = types.Tuple(
        [x if not isinstance(x, types.BaseTuple) else x[0] if the_first else types.Tuple(list(x)[1:]) for x in operands]
    )

    def codegen(context: Any, b: Any, sig: Any, args: Any) -> Any:
        values = cgutils.unpack_tuple(b, args[0])
        for i, x in enumerate(operands):
            if isinstance(x, types.BaseTuple):
                components = cgutils.unpack_tuple(b, values[i])
                values[i] = components[0] if the_first else context.make_tuple(b, parts[i], components[1:])
        return context.make_tuple(b, parts, values)

    return parts(operands, which), codegen


def halves(x: Any) -> Any:
    """The vectors of ball 1 and of ball 2."""
    n = len(x) // 2
    return x[:n], x[n:]


@compiles(halves)
def _halves(x: Any) -> Any:
    n = len(x) // 2
    return lambda x: (x[:n], x[n:])

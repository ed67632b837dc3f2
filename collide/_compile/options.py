"""The one place where compile options are decided.

`formula` marks a function of one pair: plain Python when Python calls it, compiled when any `@njit` code does.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable
from typing import Any, TypeVar

import numba
import numpy as np
from numba import types
from numba.core.ccallback import CFunc
from numba.extending import overload, register_jitable

Function = TypeVar("Function", bound=Callable[..., Any])

# error_model="python", Numba's default, tests every divisor and keeps a loop with a division scalar.
# fastmath stays off, said aloud because a callee inherits what it leaves open from its caller: contraction alone would
# end the bit equality with NumPy, and gains nothing at memory speed (test_reproducible.py holds the bits).
_OPTIONS = {"error_model": "numpy", "boundscheck": False, "fastmath": False}
# With Numba's run time the arrays and records that a function is given are counted up and down at every step of a loop.
_UNCOUNTED = {**_OPTIONS, "_nrt": False}
_INLINE = {**_UNCOUNTED, "forceinline": True}
_OUT_OF_LINE = {**_UNCOUNTED, "forceinline": False}


def formula(function: Function) -> Function:
    """Plain Python when Python calls it; in compiled code, part of what calls it."""
    register_jitable(**_INLINE)(function)
    return function


def one_pair(function: Function) -> Function:
    """As `formula`, for users to call: compiled code that gives it arrays is told so, and where to go with them."""

    def pick(*arguments: Any, **named: Any) -> Any:
        try:
            given = inspect.signature(function).bind_partial(*arguments, **named).arguments
        except TypeError:  # too many, or of other names: Numba tells so, and of which function
            return function
        for name, kind in given.items():
            if isinstance(kind, types.Array | types.BaseTuple | types.List):
                raise numba.TypingError(
                    f"{name} is {kind}: in compiled code collide.scalar.{function.__name__} takes the numbers of one "
                    f"pair. Loop over the pairs, or call collide.{function.__name__} outside of compiled code"
                )
        return function

    overload(function, jit_options=_INLINE, strict=False)(pick)
    return function


def only_outside(function: Callable[..., Any], instead: str) -> None:
    """Has compiled code that calls the function told that it cannot, and what to do instead."""

    def pick(*arguments: Any, **named: Any) -> Any:
        raise numba.TypingError(f"collide.{function.__name__} cannot be called in compiled code: {instead}")

    overload(function, strict=False)(pick)


def quiet(function: Function) -> Function:
    """As `formula`; Python runs it without NumPy's warnings: for what goes wrong where nobody takes the result."""
    plain = np.errstate(all="ignore")(function)
    overload(plain, jit_options=_INLINE, strict=False)(lambda *args: function)
    return plain


def rare(function: Function) -> Function:
    """As `formula`, but called: for what is long and seldom run, and would crowd the registers of a loop."""
    register_jitable(**_OUT_OF_LINE)(function)
    return function


def compiles(function: Callable[..., Any], *, inline: bool = True) -> Callable[[Function], Function]:
    """Marks the function that picks, by the argument types, what `function` is in compiled code."""

    def mark(pick: Function) -> Function:
        overload(function, jit_options=_INLINE if inline else _OUT_OF_LINE, strict=False)(pick)
        return pick

    return mark


def intrinsic(function: Callable[..., Any]) -> Any:
    """Numba's, for code that has no Python form: it gives a signature and emits LLVM."""
    return numba.extending.intrinsic(function)


def callback(function: Callable[..., Any], signature: Any) -> Any:
    """Numba's maker of what C code may call."""
    return CFunc(function, (signature.args, signature.return_type), {}, _UNCOUNTED)


def batch_loop(function: Callable[..., Any]) -> Any:
    """Numba's dispatcher of a loop that runs without the GIL."""
    return numba.njit(**_UNCOUNTED, nogil=True)(function)

"""What formulas use beyond operators, element by element, with the same bits for one pair and for lanes.

Each is there in three guises: a plain Python function (NumPy floats and arrays), an overload for Numba scalars, and one
for lanes. What only compiled code needs, fma and the bits of an angle's quadrant, has no plain one.
"""

from __future__ import annotations

import functools
from typing import Any

import numpy as np
from numba import types
from numba.core import cgutils

from .lanes import I64, Lanes, Mask, call_llvm, constant, in_every_lane, splat, truth_of, vector_type
from .options import compiles, intrinsic

_INFINITY = 0x7FF << 52  # the bits of infinity, and of every float64's exponent


def select(condition: Any, x: Any, y: Any) -> Any:
    """x where the condition holds, else y: numpy.where, lane by lane."""
    return np.where(condition, x, y)[()]


@compiles(select)
def _select(condition: Any, x: Any, y: Any) -> Any:
    return lambda condition, x, y: _blend(condition, x, y)  # never a branch: what it would ask cannot be guessed


@intrinsic
def _blend(typingctx: Any, mask: Any, x: Any, y: Any) -> Any:
    kind = Lanes(mask.width) if isinstance(mask, Mask) else types.float64

    def codegen(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        if isinstance(mask, Mask):
            args = [args[0], *in_every_lane(builder, Lanes, sig.args[1:], args[1:], mask.width)]
        return builder.select(*args)

    return kind(mask, *(v if isinstance(v, Lanes) else types.float64 for v in (x, y))), codegen


def square_root(x: Any) -> Any:
    """Correctly rounded, the same bits everywhere."""
    return np.sqrt(x)


@compiles(square_root)
def _square_root(x: Any) -> Any:
    return lambda x: _sqrt(x)


@intrinsic
def _sqrt(typingctx: Any, x: Any) -> Any:
    x = x if isinstance(x, Lanes) else types.float64
    return x(x), lambda context, b, sig, args: call_llvm(b, "sqrt", *args)


def as_float64(x: Any) -> Any:
    """The number or array as float64: integers would wrap, and float32 round, on the way to the answer."""
    return np.asarray(x, np.float64)[()]


@compiles(as_float64)
def _as_float64(x: Any) -> Any:
    return (lambda x: x) if isinstance(x, Lanes) else (lambda x: types.float64(x))


def is_beyond(x: Any, k: Any) -> Any:
    """Whether x is not between 2**-k and 2**k; true of NaN and of all that is negative."""
    bits = np.asarray(x, np.float64).view(np.int64)
    return ((bits < (1023 - k) << 52) | (bits >= (1023 + k) << 52))[()]


@compiles(is_beyond)
def _is_beyond(x: Any, k: Any) -> Any:
    return lambda x, k: _outside(x, k)


@intrinsic
def _outside(typingctx: Any, x: Any, k: Any) -> Any:
    if not isinstance(k, types.IntegerLiteral):
        return None
    x = x if isinstance(x, Lanes) else types.float64
    smallest, largest = (1023 - k.literal_value) << 52, (1023 + k.literal_value) << 52

    def codegen(context: Any, b: Any, sig: Any, args: Any) -> Any:
        integer = vector_type(x, I64)
        above = b.sub(b.bitcast(args[0], integer), constant(integer, smallest))
        return b.icmp_unsigned(">=", above, constant(integer, largest - smallest))

    return truth_of(x)(x, k), codegen


def inverse_power_of_two(xs: tuple[Any, ...]) -> Any:
    """The power of two s that brings the largest |x| to 2 <= s*|x| < 4; 2**1023 if all are subnormal or 0.

    0 if one is infinite or NaN. Exponents are compared as integers: a step waits four cycles for it.
    """
    largest: Any = np.int64(1 << 52)
    for x in xs:
        largest = np.maximum(largest, np.asarray(x, np.float64).view(np.int64) & _INFINITY)
    return (_INFINITY - largest).view(np.float64)[()]


@compiles(inverse_power_of_two)
def _inverse_power_of_two(xs: Any) -> Any:
    return lambda xs: _mirrored_exponent(xs)


@intrinsic
def _mirrored_exponent(typingctx: Any, xs: Any) -> Any:
    def codegen(context: Any, b: Any, sig: Any, args: Any) -> Any:
        integer = vector_type(xs.dtype, I64)
        largest = constant(integer, 1 << 52)
        for x in cgutils.unpack_tuple(b, args[0]):
            exponent = b.and_(b.bitcast(x, integer), constant(integer, _INFINITY))
            largest = b.select(b.icmp_unsigned(">", exponent, largest), exponent, largest)
        return b.bitcast(b.sub(constant(integer, _INFINITY), largest), vector_type(xs.dtype))

    return xs.dtype(xs), codegen


@intrinsic
def fma(typingctx: Any, x: Any, y: Any, z: Any) -> Any:
    """x*y + z, rounded once: the same bits on every processor, in software where there is no instruction."""
    kind = next((v for v in (x, y, z) if isinstance(v, Lanes)), types.float64)

    def codegen(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        if isinstance(kind, Lanes):
            args = in_every_lane(builder, Lanes, sig.args, args, kind.width)
        return call_llvm(builder, "fma", *args)

    return kind(*(v if isinstance(v, Lanes) else types.float64 for v in (x, y, z))), codegen


# The bits of a float64, for lanes and scalars alike.


@intrinsic
def differ_above(typingctx: Any, x: Any, y: Any, z: Any, like: Any, bit: Any) -> Any:
    """Whether x, y or z differs from the value `like` in this bit, counted from the last, or in any above it."""
    if not isinstance(bit, types.IntegerLiteral):
        return None

    def codegen(context: Any, b: Any, sig: Any, args: Any) -> Any:
        integer = vector_type(x, I64)
        same = args[3] if isinstance(like, Lanes) or not isinstance(x, Lanes) else splat(b, args[3], x.width)
        differences = [b.xor(b.bitcast(value, integer), b.bitcast(same, integer)) for value in args[:3]]
        union = b.and_(functools.reduce(b.or_, differences), constant(integer, -(1 << bit.literal_value)))
        return b.icmp_unsigned("!=", union, constant(integer, 0))

    return truth_of(x)(x, y, z, like, bit), codegen


@intrinsic
def lowest_bit(typingctx: Any, x: Any) -> Any:
    """Whether the last bit of the mantissa is set."""

    def codegen(context: Any, b: Any, sig: Any, args: Any) -> Any:
        integer = vector_type(x, I64)
        last = b.and_(b.bitcast(args[0], integer), constant(integer, 1))
        return b.icmp_unsigned("!=", last, constant(integer, 0))

    return truth_of(x)(x), codegen


@intrinsic
def flip_sign(typingctx: Any, value: Any, x: Any, bit: Any) -> Any:
    """The value, negated where this bit, counted from the last, of the mantissa of x is set."""
    if not isinstance(bit, types.IntegerLiteral):
        return None

    def codegen(context: Any, b: Any, sig: Any, args: Any) -> Any:
        integer = vector_type(value, I64)
        bits, switch = (b.bitcast(arg, integer) for arg in args[:2])
        sign = b.and_(b.shl(switch, constant(integer, 63 - bit.literal_value)), constant(integer, -(1 << 63)))
        return b.bitcast(b.xor(bits, sign), vector_type(value))

    return value(value, x, bit), codegen

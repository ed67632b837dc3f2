"""A Numba type of several float64 values that move together through the arithmetic: one vector register's worth or two.

A formula written for one pair compiles for lanes as it stands: the operators are lane-wise and give each lane the
bits that the scalar operator gives. What a formula needs beyond operators is here in three guises: a plain Python
function (NumPy floats and arrays), an overload for Numba scalars, and one for lanes.
"""

from __future__ import annotations

import builtins
import functools
import operator
from typing import Any

import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.typing.templates import AbstractTemplate, infer_global, signature
from numba.extending import lower_builtin, models, register_model

from ._jit import compiles, intrinsic

LINE = 64  # bytes: one cache line, which a streaming store has to fill

_INFINITY = 0x7FF << 52  # the bits of infinity, and of every float64's exponent
_F64, _I64, _I32 = ir.DoubleType(), ir.IntType(64), ir.IntType(32)


class Lanes(types.Type):  # type: ignore[misc]
    """`width` float64 values."""

    def __init__(self, width: int) -> None:
        self.width = width
        super().__init__(name=f"Lanes({width})")


class Mask(types.Type):  # type: ignore[misc]
    """`width` truth values: what a comparison of lanes gives."""

    def __init__(self, width: int) -> None:
        self.width = width
        super().__init__(name=f"Mask({width})")


@register_model(Lanes)
class _LanesModel(models.PrimitiveModel):  # type: ignore[misc]
    def __init__(self, manager: Any, lanes: Lanes) -> None:
        super().__init__(manager, lanes, _vector(lanes))


@register_model(Mask)
class _MaskModel(models.PrimitiveModel):  # type: ignore[misc]
    def __init__(self, manager: Any, mask: Mask) -> None:
        super().__init__(manager, mask, ir.VectorType(ir.IntType(1), mask.width))


def _vector(lanes: Any, element: Any = _F64) -> Any:
    """The LLVM type of a Numba value: a vector for lanes, the element itself for a scalar."""
    return ir.VectorType(element, lanes.width) if isinstance(lanes, Lanes | Mask) else element


def _constant(llvm_type: Any, value: float) -> Any:
    if isinstance(llvm_type, ir.VectorType):
        return ir.Constant(llvm_type, [ir.Constant(llvm_type.element, value)] * llvm_type.count)
    return ir.Constant(llvm_type, value)


def _splat(builder: Any, value: Any, width: int) -> Any:
    """One scalar in every lane."""
    vector = ir.VectorType(value.type, width)
    one = builder.insert_element(ir.Constant(vector, ir.Undefined), value, ir.Constant(_I32, 0))
    return builder.shuffle_vector(
        one, ir.Constant(vector, ir.Undefined), ir.Constant(ir.VectorType(_I32, width), [0] * width)
    )


# Operators. A float beside lanes is put into every lane.


def _binary(op: Any, emit: Any, result: type[types.Type], takes: type[types.Type]) -> None:
    @infer_global(op)
    class _Typing(AbstractTemplate):  # type: ignore[misc]
        def generic(self, args: Any, kws: Any) -> Any:
            widths = {a.width for a in args if isinstance(a, takes)}
            if len(args) == 2 and len(widths) == 1:
                wide = takes(widths.pop())
                return signature(result(wide.width), *(a if a == wide else types.float64 for a in args))
            return None

    def lower(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        width = sig.return_type.width
        pair = (v if isinstance(t, takes) else _splat(builder, v, width) for t, v in zip(sig.args, args, strict=True))
        return emit(builder, *pair)

    others = (takes, types.Float) if takes is Lanes else (takes,)
    for other in others:
        lower_builtin(op, takes, other)(lower)
        lower_builtin(op, other, takes)(lower)


# No fast-math flags: each lane has the bits that NumPy has.
_binary(operator.add, lambda b, x, y: b.fadd(x, y), Lanes, Lanes)
_binary(operator.sub, lambda b, x, y: b.fsub(x, y), Lanes, Lanes)
_binary(operator.mul, lambda b, x, y: b.fmul(x, y), Lanes, Lanes)
_binary(operator.truediv, lambda b, x, y: b.fdiv(x, y), Lanes, Lanes)
# Ordered: false where an operand is NaN, as in Python.
_binary(operator.lt, lambda b, x, y: b.fcmp_ordered("<", x, y), Mask, Lanes)
_binary(operator.le, lambda b, x, y: b.fcmp_ordered("<=", x, y), Mask, Lanes)
_binary(operator.gt, lambda b, x, y: b.fcmp_ordered(">", x, y), Mask, Lanes)
_binary(operator.ge, lambda b, x, y: b.fcmp_ordered(">=", x, y), Mask, Lanes)
_binary(operator.eq, lambda b, x, y: b.fcmp_ordered("==", x, y), Mask, Lanes)
_binary(operator.and_, lambda b, x, y: b.and_(x, y), Mask, Mask)
_binary(operator.or_, lambda b, x, y: b.or_(x, y), Mask, Mask)


def _unary(op: Any, emit: Any, takes: type[types.Type]) -> None:
    @infer_global(op)
    class _Typing(AbstractTemplate):  # type: ignore[misc]
        def generic(self, args: Any, kws: Any) -> Any:
            return signature(args[0], args[0]) if len(args) == 1 and isinstance(args[0], takes) else None

    lower_builtin(op, takes)(lambda context, builder, sig, args: emit(builder, *args))


def _call(builder: Any, name: str, *args: Any) -> Any:
    """An LLVM intrinsic that gives its first argument's type. llvmlite's own look-up knows no vector types."""
    kind = args[0].type
    element = kind.element if isinstance(kind, ir.VectorType) else kind
    suffix = f"{f'v{kind.count}' if kind != element else ''}{'f64' if element == _F64 else 'f32'}"
    function = ir.FunctionType(kind, [a.type for a in args])
    return builder.call(cgutils.get_or_insert_function(builder.module, function, f"llvm.{name}.{suffix}"), args)


_unary(operator.neg, lambda b, x: b.fneg(x), Lanes)
_unary(builtins.abs, lambda b, x: _call(b, "fabs", x), Lanes)
_unary(operator.invert, lambda b, x: b.not_(x), Mask)


# What formulas use beyond operators.


def select(condition: Any, x: Any, y: Any) -> Any:
    """x where the condition holds, else y: numpy.where, lane by lane."""
    return np.where(condition, x, y)[()]


@compiles(select)
def _select(condition: Any, x: Any, y: Any) -> Any:
    if isinstance(condition, Mask):
        return lambda condition, x, y: _blend(condition, x, y)
    return lambda condition, x, y: x if condition else y


@intrinsic
def _blend(typingctx: Any, mask: Any, x: Any, y: Any) -> Any:
    lanes = Lanes(mask.width)

    def codegen(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        values = (
            v if isinstance(t, Lanes) else _splat(builder, v, mask.width)
            for t, v in zip(sig.args[1:], args[1:], strict=True)
        )
        return builder.select(args[0], *values)

    return lanes(mask, *(v if isinstance(v, Lanes) else types.float64 for v in (x, y))), codegen


def square_root(x: Any) -> Any:
    """Correctly rounded, the same bits everywhere."""
    return np.sqrt(x)


@compiles(square_root)
def _square_root(x: Any) -> Any:
    return lambda x: _sqrt(x)


@intrinsic
def _sqrt(typingctx: Any, x: Any) -> Any:
    x = x if isinstance(x, Lanes) else types.float64
    return x(x), lambda context, b, sig, args: _call(b, "sqrt", *args)


def as_float64(x: Any) -> Any:
    """The number or array as float64: integers would wrap, and float32 round, on the way to the answer."""
    return np.asarray(x, np.float64)[()]


@compiles(as_float64)
def _as_float64(x: Any) -> Any:
    return (lambda x: x) if isinstance(x, Lanes) else (lambda x: types.float64(x))


# A sum of masses between these powers of two stays far from overflow, underflow and their rounding when it is
# multiplied by the square of a normal.
_SMALLEST, _LARGEST = (1023 - 400) << 52, (1023 + 400) << 52


def is_extreme(x: Any) -> Any:
    """Whether x is not between 2**-400 and 2**400; true of NaN and of all that is negative."""
    bits = np.asarray(x, np.float64).view(np.int64)
    return ((bits < _SMALLEST) | (bits >= _LARGEST))[()]


@compiles(is_extreme)
def _is_extreme(x: Any) -> Any:
    return lambda x: _outside(x)


@intrinsic
def _outside(typingctx: Any, x: Any) -> Any:
    x = x if isinstance(x, Lanes) else types.float64

    def codegen(context: Any, b: Any, sig: Any, args: Any) -> Any:
        integer = _vector(x, _I64)
        above = b.sub(b.bitcast(args[0], integer), _constant(integer, _SMALLEST))
        return b.icmp_unsigned(">=", above, _constant(integer, _LARGEST - _SMALLEST))

    return (Mask(x.width) if isinstance(x, Lanes) else types.boolean)(x), codegen


def inverse_power_of_two(x: Any, y: Any) -> Any:
    """The power of two s that brings the larger of |x| and |y| to 2 <= s*|x| < 4; 2**1023 if both are subnormal or 0.

    0 if one is infinite or NaN. Exponents are compared as integers: a step waits four cycles for it.
    """
    exponents = (np.asarray(value, np.float64).view(np.int64) & _INFINITY for value in (x, y))
    return (_INFINITY - np.maximum(np.maximum(*exponents), 1 << 52)).view(np.float64)[()]


@compiles(inverse_power_of_two)
def _inverse_power_of_two(x: Any, y: Any) -> Any:
    return lambda x, y: _mirrored_exponent(x, y)


@intrinsic
def _mirrored_exponent(typingctx: Any, x: Any, y: Any) -> Any:
    x, y = (v if isinstance(v, Lanes) else types.float64 for v in (x, y))

    def codegen(context: Any, b: Any, sig: Any, args: Any) -> Any:
        integer = _vector(x, _I64)
        largest = _constant(integer, 1 << 52)
        for value in args:
            exponent = b.and_(b.bitcast(value, integer), _constant(integer, _INFINITY))
            largest = b.select(b.icmp_unsigned(">", exponent, largest), exponent, largest)
        return b.bitcast(b.sub(_constant(integer, _INFINITY), largest), _vector(x))

    return x(x, y), codegen


@intrinsic
def fma(typingctx: Any, x: Any, y: Any, z: Any) -> Any:
    """x*y + z, rounded once: the same bits on every processor, in software where there is no instruction."""
    kind = next((v for v in (x, y, z) if isinstance(v, Lanes)), types.float64)

    def codegen(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        if isinstance(kind, Lanes):
            args = [
                v if isinstance(t, Lanes) else _splat(builder, v, kind.width)
                for t, v in zip(sig.args, args, strict=True)
            ]
        return _call(builder, "fma", *args)

    return kind(*(v if isinstance(v, Lanes) else types.float64 for v in (x, y, z))), codegen


# Tuples of lanes: the velocities of a step.


@intrinsic
def select_each(typingctx: Any, mask: Any, xs: Any, ys: Any) -> Any:
    """select(mask, x, y) for each pair of two tuples."""

    def codegen(context: Any, b: Any, sig: Any, args: Any) -> Any:
        pairs = zip(cgutils.unpack_tuple(b, args[1]), cgutils.unpack_tuple(b, args[2]), strict=True)
        return context.make_tuple(b, sig.return_type, [b.select(args[0], x, y) for x, y in pairs])

    return xs(mask, xs, ys), codegen


@intrinsic
def fill(typingctx: Any, like: Any, x: Any) -> Any:
    """A tuple like this one with x in every lane."""

    def codegen(context: Any, b: Any, sig: Any, args: Any) -> Any:
        return context.make_tuple(b, sig.return_type, [_splat(b, args[1], like.dtype.width)] * like.count)

    return like(like, types.float64), codegen


# Whether results are finite is asked of them as they will be stored: rounded to float32 where `dtype` is that.


def _stored(builder: Any, values: Any, dtype: Any) -> list[Any]:
    values = cgutils.unpack_tuple(builder, values)
    if dtype == types.float64:
        return values  # type: ignore[no-any-return]
    return [builder.fptrunc(v, ir.VectorType(ir.FloatType(), v.type.count)) for v in values]


@intrinsic
def all_finite(typingctx: Any, values: Any, outputs: Any) -> Any:
    """Lane by lane, whether every value of the tuple is finite in the outputs."""

    def codegen(context: Any, b: Any, sig: Any, args: Any) -> Any:
        stored = _stored(b, args[0], outputs.dtype.dtype)
        infinity = _constant(stored[0].type, float("inf"))
        return functools.reduce(b.and_, (b.fcmp_ordered("<", _call(b, "fabs", v), infinity) for v in stored))

    return Mask(values.dtype.width)(values, outputs), codegen


@intrinsic
def doubt(typingctx: Any, change: Any, outputs: Any, signs: Any) -> Any:
    """Lane by lane, whether a change is too large for velocities to stay finite in the outputs, or a sign bit is set.

    The quick look before the exact one, an integer comparison of the change under the union of the signs. A finite
    velocity overflows only by a change of half its last bit, 2**970 for float64 and 2**103 for float32; the limits
    leave room for a normal of length 6. A sum of changes does: of masses that are not negative they have one sign. To
    ask the results themselves is three additions and ten cycles later, which cost a tenth of the speed in cache.
    """
    limit = (1023 + (960 if outputs.dtype.dtype == types.float64 else 90)) << 52

    def codegen(context: Any, b: Any, sig: Any, args: Any) -> Any:
        wide, integer = _vector(change), _vector(change, _I64)
        union = functools.reduce(b.or_, (b.bitcast(s, integer) for s in cgutils.unpack_tuple(b, args[2])))
        both = b.bitcast(_call(b, "copysign", args[0], b.bitcast(union, wide)), integer)
        return b.icmp_unsigned(">=", both, _constant(integer, limit))

    return Mask(change.width)(change, outputs, signs), codegen


# The bits of a float64, for lanes and scalars alike.


@intrinsic
def differ_above(typingctx: Any, x: Any, y: Any, z: Any, like: Any, bit: Any) -> Any:
    """Whether x, y or z differs from the value `like` in this bit, counted from the last, or in any above it."""
    if not isinstance(bit, types.IntegerLiteral):
        return None

    def codegen(context: Any, b: Any, sig: Any, args: Any) -> Any:
        integer = _vector(x, _I64)
        same = args[3] if isinstance(like, Lanes) or not isinstance(x, Lanes) else _splat(b, args[3], x.width)
        differences = [b.xor(b.bitcast(value, integer), b.bitcast(same, integer)) for value in args[:3]]
        union = b.and_(functools.reduce(b.or_, differences), _constant(integer, -(1 << bit.literal_value)))
        return b.icmp_unsigned("!=", union, _constant(integer, 0))

    return (Mask(x.width) if isinstance(x, Lanes) else types.boolean)(x, y, z, like, bit), codegen


@intrinsic
def lowest_bit(typingctx: Any, x: Any) -> Any:
    """Whether the last bit of the mantissa is set."""

    def codegen(context: Any, b: Any, sig: Any, args: Any) -> Any:
        integer = _vector(x, _I64)
        last = b.and_(b.bitcast(args[0], integer), _constant(integer, 1))
        return b.icmp_unsigned("!=", last, _constant(integer, 0))

    return (Mask(x.width) if isinstance(x, Lanes) else types.boolean)(x), codegen


@intrinsic
def flip_sign(typingctx: Any, value: Any, x: Any, bit: Any) -> Any:
    """The value, negated where this bit, counted from the last, of the mantissa of x is set."""
    if not isinstance(bit, types.IntegerLiteral):
        return None

    def codegen(context: Any, b: Any, sig: Any, args: Any) -> Any:
        integer = _vector(value, _I64)
        bits, switch = (b.bitcast(arg, integer) for arg in args[:2])
        sign = b.and_(b.shl(switch, _constant(integer, 63 - bit.literal_value)), _constant(integer, -(1 << 63)))
        return b.bitcast(b.xor(bits, sign), _vector(value))

    return value(value, x, bit), codegen


# Lanes and their neighbours.


def any_lane(condition: Any) -> Any:
    """Whether the condition holds in some lane; of a scalar, itself. The compiler is told that it is rare."""
    return np.any(condition)


@compiles(any_lane)
def _any_lane(condition: Any) -> Any:
    if isinstance(condition, Mask):
        return lambda condition: _unlikely(count(condition) != 0)
    return lambda condition: _unlikely(condition)


@intrinsic
def _unlikely(typingctx: Any, condition: Any) -> Any:
    def codegen(context: Any, b: Any, sig: Any, args: Any) -> Any:
        bit = ir.IntType(1)
        function = ir.FunctionType(bit, [bit, bit])
        expect = cgutils.get_or_insert_function(b.module, function, "llvm.expect.i1")
        return b.call(expect, [args[0], ir.Constant(bit, 0)])

    return types.boolean(types.boolean), codegen


@intrinsic
def count(typingctx: Any, mask: Any) -> Any:
    """How many lanes hold."""

    def codegen(context: Any, b: Any, sig: Any, args: Any) -> Any:
        bits = b.zext(b.bitcast(args[0], ir.IntType(mask.width)), _I64)
        return b.ctpop(bits)

    return types.intp(mask), codegen


@intrinsic
def first(typingctx: Any, mask: Any) -> Any:
    """The number of the first lane that holds; some lane must."""

    def codegen(context: Any, b: Any, sig: Any, args: Any) -> Any:
        bits = b.zext(b.bitcast(args[0], ir.IntType(mask.width)), _I64)
        return b.cttz(bits, ir.Constant(ir.IntType(1), 1))

    return types.intp(mask), codegen


@intrinsic
def leading(typingctx: Any, mask: Any, n: Any) -> Any:
    """The mask without its lanes from number n on."""

    def codegen(context: Any, b: Any, sig: Any, args: Any) -> Any:
        return b.and_(args[0], lanes_below(b, args[1], mask.width))

    return mask(mask, types.int64), codegen


def lanes_below(builder: Any, n: Any, width: int) -> Any:
    """LLVM's mask of the lanes numbered below n."""
    numbers = ir.Constant(ir.VectorType(n.type, width), list(range(width)))
    return builder.icmp_signed("<", numbers, _splat(builder, n, width))


@intrinsic
def out_of_line(typingctx: Any) -> Any:
    """Keeps the function that calls it out of its callers, whose registers and code it would crowd."""

    def codegen(context: Any, b: Any, sig: Any, args: Any) -> Any:
        b.function.attributes.add("noinline")
        b.function.attributes.add("cold")
        return context.get_dummy_value()

    return types.void(), codegen


@intrinsic
def get(typingctx: Any, lanes: Any, i: Any) -> Any:
    """The value in lane i."""
    return types.float64(lanes, types.intp), lambda context, b, sig, args: b.extract_element(*args)


@intrinsic
def put(typingctx: Any, lanes: Any, i: Any, value: Any) -> Any:
    """The lanes, with the value in lane i."""
    return lanes(lanes, types.intp, types.float64), lambda context, b, sig, args: b.insert_element(
        args[0], args[2], args[1]
    )

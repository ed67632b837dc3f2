"""A Numba type of several float64 values that move together through the arithmetic: one vector register's worth or two.

A formula written for one pair compiles for lanes as it stands: the operators are lane-wise and give each lane the
bits that the scalar operator gives. Here are the type, its operators, what a step does with tuples of lanes, and what
looks across lanes; what formulas use beyond operators is in elementwise.py.
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

from .options import compiles, intrinsic

F64, I64, I32 = ir.DoubleType(), ir.IntType(64), ir.IntType(32)


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
@register_model(Mask)
class _Model(models.PrimitiveModel):  # type: ignore[misc]
    def __init__(self, manager: Any, kind: Lanes | Mask) -> None:
        super().__init__(manager, kind, vector_type(kind, F64 if isinstance(kind, Lanes) else ir.IntType(1)))


def vector_type(lanes: Any, element: Any = F64) -> Any:
    """The LLVM type of a Numba value: a vector for lanes, the element itself for a scalar."""
    return ir.VectorType(element, lanes.width) if isinstance(lanes, Lanes | Mask) else element


def constant(llvm_type: Any, value: float) -> Any:
    if isinstance(llvm_type, ir.VectorType):
        return ir.Constant(llvm_type, [ir.Constant(llvm_type.element, value)] * llvm_type.count)
    return ir.Constant(llvm_type, value)


def splat(builder: Any, value: Any, width: int) -> Any:
    """One scalar in every lane."""
    vector = ir.VectorType(value.type, width)
    one = builder.insert_element(ir.Constant(vector, ir.Undefined), value, ir.Constant(I32, 0))
    return builder.shuffle_vector(
        one, ir.Constant(vector, ir.Undefined), ir.Constant(ir.VectorType(I32, width), [0] * width)
    )


def in_every_lane(builder: Any, lanes: type[types.Type], kinds: Any, values: Any, width: int) -> list[Any]:
    """The values, of which those that are no lanes, by their Numba types, are put into every lane."""
    pairs = zip(kinds, values, strict=True)
    return [v if isinstance(kind, lanes) else splat(builder, v, width) for kind, v in pairs]


def truth_of(x: Any) -> Any:
    """The Numba type of what is asked of each lane, or of a scalar."""
    return Mask(x.width) if isinstance(x, Lanes) else types.boolean


# Operators. A float beside lanes, or a truth value beside a mask, is put into every lane.


def _binary(op: Any, emit: Any, result: type[types.Type], takes: type[types.Type]) -> None:
    scalar, scalars = (types.float64, types.Float) if takes is Lanes else (types.boolean, types.Boolean)

    @infer_global(op)
    class _Typing(AbstractTemplate):  # type: ignore[misc]
        def generic(self, args: Any, kws: Any) -> Any:
            widths = {a.width for a in args if isinstance(a, takes)}
            if len(args) == 2 and len(widths) == 1:
                wide = takes(widths.pop())
                return signature(result(wide.width), *(a if a == wide else scalar for a in args))
            return None

    def lower(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        return emit(builder, *in_every_lane(builder, takes, sig.args, args, sig.return_type.width))

    for other in (takes, scalars):
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


def call_llvm(builder: Any, name: str, *args: Any) -> Any:
    """An LLVM intrinsic that gives its first argument's type. llvmlite's own look-up knows no vector types."""
    kind = args[0].type
    element = kind.element if isinstance(kind, ir.VectorType) else kind
    suffix = f"{f'v{kind.count}' if kind != element else ''}{'f64' if element == F64 else 'f32'}"
    function = ir.FunctionType(kind, [a.type for a in args])
    return builder.call(cgutils.get_or_insert_function(builder.module, function, f"llvm.{name}.{suffix}"), args)


_unary(operator.neg, lambda b, x: b.fneg(x), Lanes)
_unary(builtins.abs, lambda b, x: call_llvm(b, "fabs", x), Lanes)
_unary(operator.invert, lambda b, x: b.not_(x), Mask)


# Tuples of lanes: the velocities of a step.


@intrinsic
def fill(typingctx: Any, like: Any, x: Any) -> Any:
    """A tuple like this one with x in every lane."""

    def codegen(context: Any, b: Any, sig: Any, args: Any) -> Any:
        return context.make_tuple(b, sig.return_type, [splat(b, args[1], like.dtype.width)] * like.count)

    return like(like, types.float64), codegen


# Whether results are finite is asked of them as they will be stored: rounded to float32 where `dtype` is that.


def _stored(builder: Any, values: Any, dtype: Any) -> list[Any]:
    values = cgutils.unpack_tuple(builder, values)
    if dtype == types.float64:
        return values  # type: ignore[no-any-return]
    narrow = ir.FloatType() if values[0].type == F64 else ir.VectorType(ir.FloatType(), values[0].type.count)
    return [builder.fptrunc(v, narrow) for v in values]


@intrinsic
def all_finite(typingctx: Any, values: Any, outputs: Any) -> Any:
    """Lane by lane, or for scalars, whether every value of the tuple is finite in the outputs."""

    def codegen(context: Any, b: Any, sig: Any, args: Any) -> Any:
        stored = _stored(b, args[0], outputs.dtype.dtype)
        infinity = constant(stored[0].type, float("inf"))
        return functools.reduce(b.and_, (b.fcmp_ordered("<", call_llvm(b, "fabs", v), infinity) for v in stored))

    return truth_of(values.dtype)(values, outputs), codegen


@intrinsic
def doubt(typingctx: Any, change: Any, outputs: Any, signs: Any) -> Any:
    """Lane by lane, whether a change is too large for velocities to stay finite in the outputs, or a sign bit is set.

    The quick check before the exact one: the change gets the OR of all signs as its own, so that one comparison of
    unsigned integers finds a large change and any sign bit. The limit: a
    finite velocity v is at most M = 2**1024 - 2**970, in float32 2**128 - 2**104, and v + a n is finite as long as
    |a n| is below half of M's last place, 2**970 or 2**103. As |n| < 2**35, |a| < 2**930 will do for float64, with 5
    powers to spare for rounding; and for float32 2**65, with 3. The change given is j1 + j2: of masses that are not
    negative both have one sign, so neither is larger. NaN and infinity have larger exponents, and are in doubt.
    To ask the results themselves is three additions and ten cycles later, which cost a tenth of the speed in cache.
    """
    limit = (1023 + (930 if outputs.dtype.dtype == types.float64 else 65)) << 52

    def codegen(context: Any, b: Any, sig: Any, args: Any) -> Any:
        wide, integer = vector_type(change), vector_type(change, I64)
        union = functools.reduce(b.or_, (b.bitcast(s, integer) for s in cgutils.unpack_tuple(b, args[2])))
        both = b.bitcast(call_llvm(b, "copysign", args[0], b.bitcast(union, wide)), integer)
        return b.icmp_unsigned(">=", both, constant(integer, limit))

    return truth_of(change)(change, outputs, signs), codegen


# Lanes and their neighbours.


def any_lane(condition: Any) -> Any:
    """Whether the condition holds in some lane; of a scalar, itself. The compiler is told that it is rare."""
    return np.any(condition)


@compiles(any_lane)
def _any_lane(condition: Any) -> Any:
    if isinstance(condition, Mask):
        return lambda condition: _unlikely(count(condition) != 0)
    return lambda condition: _unlikely(condition)


def all_lanes(condition: Any) -> Any:
    """Whether the condition holds in every lane; of a scalar, itself. The compiler is told that it mostly does."""
    return np.all(condition)


@compiles(all_lanes)
def _all_lanes(condition: Any) -> Any:
    if isinstance(condition, Mask):
        width = condition.width
        return lambda condition: not _unlikely(count(condition) != width)
    return lambda condition: not _unlikely(not condition)


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
        bits = b.zext(b.bitcast(args[0], ir.IntType(mask.width)), I64)
        return b.ctpop(bits)

    return types.intp(mask), codegen


@intrinsic
def first(typingctx: Any, mask: Any) -> Any:
    """The number of the first lane that holds; some lane must."""

    def codegen(context: Any, b: Any, sig: Any, args: Any) -> Any:
        bits = b.zext(b.bitcast(args[0], ir.IntType(mask.width)), I64)
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
    return builder.icmp_signed("<", numbers, splat(builder, n, width))


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

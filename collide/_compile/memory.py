"""Lanes in and out of memory: columns of float64 or float32 on one side, float64 lanes on the other.

A column is a contiguous array, or, for a scalar, an empty one whose value stands in `scalars`: one compiled kernel
serves every mix of the two. A step takes as many pairs as fill a cache line of the storage, 8 or 16. Numba does not ask
whether arrays are aligned, so nothing is promised of them, but where a line is to stream.
"""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils

from .._system.memory import CACHE_LINE
from .lanes import F64, I32, Lanes, constant, lanes_below, out_of_line, splat
from .options import formula, intrinsic, rare

_SUFFIX = {"double": "f64", "float": "f32", "i32": "i32", "i64": "i64"}


def lanes_of(dtype: Any) -> Lanes:
    """The lanes that one step over storage of this dtype moves."""
    return Lanes(CACHE_LINE * 8 // dtype.bitwidth)


def pointer(context: Any, builder: Any, array_type: Any, array: Any, k: Any, kind: Any) -> Any:
    """Element k of an array as an LLVM pointer to a value of this kind."""
    data = context.make_array(array_type)(context, builder, array).data
    return builder.bitcast(builder.gep(data, [k], inbounds=True), kind.as_pointer())


def _vector(dtype: Any) -> Any:
    """The LLVM type of what a step moves, as it is stored."""
    return ir.VectorType(F64 if dtype == types.float64 else ir.FloatType(), lanes_of(dtype).width)


def masked_move(builder: Any, name: str, vector: Any, result: Any, args: list[Any]) -> Any:
    """A call of llvm.masked.load or .store; lanes that are off touch no memory."""
    kind = f"v{vector.count}{_SUFFIX[str(vector.element)]}"
    function = ir.FunctionType(result, [a.type for a in args])
    name = f"llvm.masked.{name}.{kind}.p0"
    return builder.call(cgutils.get_or_insert_function(builder.module, function, name), args)


def _merge(builder: Any, *ways: tuple[Any, Any]) -> Any:
    """The value that came by the way that was taken."""
    phi = builder.phi(ways[0][0].type)
    for value, block in ways:
        phi.add_incoming(value, block)
    return phi


@intrinsic
def load(typingctx: Any, columns: Any, scalars: Any, k: Any, n: Any, usual: Any) -> Any:
    """Pairs k to k+n of every column; lanes past n hold ones, a valid pair. `usual`: only the last may be a scalar.

    What is emitted, for `width` lanes; `either` is a broadcast of the scalar where the column is empty:

        if n == width:
            if usual: whole line of each column but the last; either(last)
            else:     either(column), of whole lines, for each
        else:         either(column), masked to lanes below n, for each

    as a masked load costs a full step a quarter of its time, and a branch a column a tenth.
    """
    dtype = columns.dtype.dtype
    lanes = lanes_of(dtype)
    wide, vector = ir.VectorType(F64, lanes.width), _vector(dtype)

    def codegen(context: Any, b: Any, sig: Any, args: Any) -> Any:
        arrays, scalar_array, k, n, usual = args
        values = context.make_array(sig.args[1])(context, b, scalar_array).data
        arrays = cgutils.unpack_tuple(b, arrays)

        def same(i: int) -> Any:
            return splat(b, b.load(b.gep(values, [ir.Constant(I32, i)])), lanes.width)

        def each(i: int, mask: Any) -> Any:
            address = pointer(context, b, columns.dtype, arrays[i], k, vector)
            if mask is None:
                value = b.load(address, align=1)
            else:
                rest = [address, ir.Constant(I32, 1), mask, constant(vector, 1.0)]
                value = masked_move(b, "load", vector, vector, rest)
            return value if dtype == types.float64 else b.fpext(value, wide)

        def either(i: int, mask: Any) -> Any:
            """Column i: an empty array stands for a scalar."""
            length = context.make_array(columns.dtype)(context, b, arrays[i]).nitems
            with b.if_else(b.icmp_signed("==", length, ir.Constant(length.type, 0))) as (scalar, array):
                with scalar:
                    from_scalar = same(i), b.block
                with array:
                    from_array = each(i, mask), b.block
            return _merge(b, from_scalar, from_array)

        numbers = range(columns.count)
        with b.if_else(b.icmp_signed("==", n, ir.Constant(n.type, lanes.width))) as (whole, part):
            with whole:
                with b.if_else(usual) as (straight, mixed):
                    with straight:
                        quick = [*(each(i, None) for i in numbers[:-1]), either(numbers[-1], None)]
                        from_quick = b.block
                    with mixed:
                        branched = [either(i, None) for i in numbers]
                        from_branched = b.block
                full = [_merge(b, (x, from_quick), (y, from_branched)) for x, y in zip(quick, branched, strict=True)]
                from_whole = b.block
            with part:
                mask = lanes_below(b, n, lanes.width)
                masked = [either(i, mask) for i in numbers]
                from_part = b.block
        merged = [_merge(b, (x, from_whole), (y, from_part)) for x, y in zip(full, masked, strict=True)]
        return context.make_tuple(b, sig.return_type, merged)

    return types.UniTuple(lanes, columns.count)(columns, scalars, types.int64, types.int64, types.boolean), codegen


@intrinsic
def store(typingctx: Any, outputs: Any, k: Any, n: Any, values: Any, streaming: Any) -> Any:
    """The values of pairs k to k+n into the outputs. A full, aligned line may stream past the caches."""
    dtype = outputs.dtype.dtype
    lanes, vector = lanes_of(dtype), _vector(dtype)

    def codegen(context: Any, b: Any, sig: Any, args: Any) -> Any:
        arrays, k, n, lanes_out, streaming = args
        targets = []
        for array, value in zip(cgutils.unpack_tuple(b, arrays), cgutils.unpack_tuple(b, lanes_out), strict=True):
            address = pointer(context, b, outputs.dtype, array, k, vector)
            targets.append((value if dtype == types.float64 else b.fptrunc(value, vector), address))
        full = b.icmp_signed("==", n, ir.Constant(n.type, lanes.width))
        with b.if_else(full) as (whole, part):
            with whole, b.if_else(streaming) as (stream, plain):
                with stream:
                    for value, address in targets:
                        instruction = b.store(value, address, align=CACHE_LINE)
                        hint = b.module.add_metadata([ir.Constant(I32, 1)])
                        instruction.set_metadata("nontemporal", hint)
                with plain:
                    for value, address in targets:
                        b.store(value, address, align=1)
            with part:
                mask = lanes_below(b, n, lanes.width)
                for value, address in targets:
                    masked_move(b, "store", vector, ir.VoidType(), [value, address, ir.Constant(I32, 1), mask])
        return context.get_dummy_value()

    return types.void(outputs, types.int64, types.int64, values, types.boolean), codegen


@formula
def lead(outputs: Any, start: int) -> Any:
    """Pairs from `start` to the first cache line boundary of the outputs; -1 where the outputs do not agree on one."""
    item = outputs[0].itemsize
    offset = (outputs[0].ctypes.data + start * item) % CACHE_LINE
    for u in outputs:
        if (u.ctypes.data + start * item) % CACHE_LINE != offset:
            return -1
    if offset % item != 0:
        return -1
    return (CACHE_LINE - offset) % CACHE_LINE // item


@rare
def overlap(columns: Any, outputs: Any) -> int:
    """How the outputs lie to the columns and to each other: 0 apart, 1 some in place, -1 in any other way."""
    out_of_line()
    relation = 0
    for i in range(len(outputs)):
        u, size = outputs[i].ctypes.data, outputs[i].nbytes
        for c in columns:
            a = c.ctypes.data
            if a < u + size and u < a + c.nbytes:
                if a != u or c.nbytes != size:
                    return -1
                relation = 1
        for j in range(i):
            b = outputs[j].ctypes.data
            if b < u + size and u < b + outputs[j].nbytes:
                return -1
    return relation


@rare
def is_usual(columns: Any) -> bool:
    """Whether all columns but the last are arrays."""
    out_of_line()
    n_scalars = 0
    for c in columns[:-1]:
        n_scalars += c.size == 0
    return n_scalars == 0

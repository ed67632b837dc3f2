"""Lanes in and out of memory: columns of float64 or float32 on one side, float64 lanes on the other.

A column is a contiguous array, or, for a scalar, an empty one whose value stands in `scalars`: one compiled kernel
serves every mix of the two. A step takes as many pairs as fill a cache line of the storage, 8 or 16.
"""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils

from ._jit import formula, intrinsic
from ._lanes import _F64, _I32, LINE, Lanes, _constant, _splat, lanes_below


def lanes_of(dtype: Any) -> Lanes:
    """The lanes that one step over storage of this dtype moves."""
    return Lanes(LINE * 8 // dtype.bitwidth)


def _vector_pointer(context: Any, builder: Any, array_type: Any, array: Any, k: Any) -> tuple[Any, Any]:
    """The LLVM vector type of a step and the address of element k as a pointer to one."""
    element = ir.DoubleType() if array_type.dtype == types.float64 else ir.FloatType()
    vector = ir.VectorType(element, lanes_of(array_type.dtype).width)
    data = context.make_array(array_type)(context, builder, array).data
    return vector, builder.bitcast(builder.gep(data, [k], inbounds=True), vector.as_pointer())


def _masked(builder: Any, name: str, vector: Any, result: Any, args: list[Any]) -> Any:
    """A call of llvm.masked.load or .store; lanes that are off touch no memory."""
    kind = f"v{vector.count}{'f64' if vector.element == _F64 else 'f32'}"
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
def load(typingctx: Any, columns: Any, scalars: Any, k: Any, n: Any) -> Any:
    """Pairs k to k+n of every column; lanes past n hold zeros."""
    dtype = columns.dtype.dtype
    lanes = lanes_of(dtype)
    wide = ir.VectorType(_F64, lanes.width)
    align = dtype.bitwidth // 8

    def codegen(context: Any, b: Any, sig: Any, args: Any) -> Any:
        arrays, scalar_array, k, n = args
        values = context.make_array(sig.args[1])(context, b, scalar_array).data
        arrays = cgutils.unpack_tuple(b, arrays)

        def one(i: int, mask: Any) -> Any:
            """Column i: an empty array stands for a scalar."""
            vector, address = _vector_pointer(context, b, columns.dtype, arrays[i], k)
            length = context.make_array(columns.dtype)(context, b, arrays[i]).nitems
            with b.if_else(b.icmp_signed("==", length, ir.Constant(length.type, 0))) as (scalar, array):
                with scalar:
                    same = _splat(b, b.load(b.gep(values, [ir.Constant(_I32, i)])), lanes.width)
                    from_scalar = b.block
                with array:
                    if mask is None:
                        each = b.load(address, align=align)
                    else:
                        rest = [address, ir.Constant(_I32, align), mask, _constant(vector, 0.0)]
                        each = _masked(b, "load", vector, vector, rest)
                    each = each if dtype == types.float64 else b.fpext(each, wide)
                    from_array = b.block
            return _merge(b, (same, from_scalar), (each, from_array))

        # A masked load costs a full step a quarter of its time, so whole lines go without.
        with b.if_else(b.icmp_signed("==", n, ir.Constant(n.type, lanes.width))) as (whole, part):
            with whole:
                full = [one(i, None) for i in range(columns.count)]
                from_whole = b.block
            with part:
                mask = lanes_below(b, n, lanes.width)
                masked = [one(i, mask) for i in range(columns.count)]
                from_part = b.block
        merged = [_merge(b, (x, from_whole), (y, from_part)) for x, y in zip(full, masked, strict=True)]
        return context.make_tuple(b, sig.return_type, merged)

    return types.UniTuple(lanes, columns.count)(columns, scalars, types.int64, types.int64), codegen


@intrinsic
def store(typingctx: Any, outputs: Any, k: Any, n: Any, values: Any, streaming: Any) -> Any:
    """The values of pairs k to k+n into the outputs. A full, aligned line may stream past the caches."""
    dtype = outputs.dtype.dtype
    lanes = lanes_of(dtype)
    align = dtype.bitwidth // 8

    def codegen(context: Any, b: Any, sig: Any, args: Any) -> Any:
        arrays, k, n, lanes_out, streaming = args
        targets = []
        for array, value in zip(cgutils.unpack_tuple(b, arrays), cgutils.unpack_tuple(b, lanes_out), strict=True):
            vector, address = _vector_pointer(context, b, outputs.dtype, array, k)
            targets.append((value if dtype == types.float64 else b.fptrunc(value, vector), address, vector))
        full = b.icmp_signed("==", n, ir.Constant(n.type, lanes.width))
        with b.if_else(full) as (whole, part):
            with whole, b.if_else(streaming) as (stream, plain):
                with stream:
                    for value, address, _ in targets:
                        instruction = b.store(value, address, align=LINE)
                        hint = b.module.add_metadata([ir.Constant(_I32, 1)])
                        instruction.set_metadata("nontemporal", hint)
                with plain:
                    for value, address, _ in targets:
                        b.store(value, address, align=align)
            with part:
                mask = lanes_below(b, n, lanes.width)
                for value, address, vector in targets:
                    _masked(b, "store", vector, ir.VoidType(), [value, address, ir.Constant(_I32, align), mask])
        return context.get_dummy_value()

    return types.void(outputs, types.int64, types.int64, values, types.boolean), codegen


@formula
def lead(outputs: Any, start: int) -> Any:
    """Pairs from `start` to the first cache line boundary of the outputs; -1 where the outputs do not agree on one."""
    item = outputs[0].itemsize
    offset = (outputs[0].ctypes.data + start * item) % LINE
    for u in outputs:
        if (u.ctypes.data + start * item) % LINE != offset:
            return -1
    if offset % item != 0:
        return -1
    return (LINE - offset) % LINE // item

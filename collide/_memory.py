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

from ._jit import formula, intrinsic, rare
from ._lanes import _F64, _I32, _I64, LINE, Lanes, _constant, _splat, lanes_below, out_of_line

_SUFFIX = {"double": "f64", "float": "f32", "i32": "i32", "i64": "i64"}


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
    """Pairs k to k+n of every column; lanes past n hold ones, a valid pair. `usual`: only the last may be a scalar."""
    dtype = columns.dtype.dtype
    lanes = lanes_of(dtype)
    wide = ir.VectorType(_F64, lanes.width)

    def codegen(context: Any, b: Any, sig: Any, args: Any) -> Any:
        arrays, scalar_array, k, n, usual = args
        values = context.make_array(sig.args[1])(context, b, scalar_array).data
        arrays = cgutils.unpack_tuple(b, arrays)

        def same(i: int) -> Any:
            return _splat(b, b.load(b.gep(values, [ir.Constant(_I32, i)])), lanes.width)

        def each(i: int, mask: Any) -> Any:
            vector, address = _vector_pointer(context, b, columns.dtype, arrays[i], k)
            if mask is None:
                value = b.load(address, align=1)
            else:
                rest = [address, ir.Constant(_I32, 1), mask, _constant(vector, 1.0)]
                value = _masked(b, "load", vector, vector, rest)
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

        # A masked load costs a full step a quarter of its time, so whole lines go without, and a branch a column a
        # tenth, so the usual batch goes without those.
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
    lanes = lanes_of(dtype)

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
                        b.store(value, address, align=1)
            with part:
                mask = lanes_below(b, n, lanes.width)
                for value, address, vector in targets:
                    _masked(b, "store", vector, ir.VoidType(), [value, address, ir.Constant(_I32, 1), mask])
        return context.get_dummy_value()

    return types.void(outputs, types.int64, types.int64, values, types.boolean), codegen


# Three cells of a row seldom hold more balls than these: with eight, the search for contacts took a third longer.
WINDOW = 4


@intrinsic
def window(typingctx: Any, array: Any, k: Any) -> Any:
    """The values of WINDOW elements from k on. There must be as many."""
    lanes = Lanes(WINDOW)

    def codegen(context: Any, b: Any, sig: Any, args: Any) -> Any:
        data = context.make_array(array)(context, b, args[0]).data
        vector = ir.VectorType(_F64, WINDOW)
        return b.load(b.bitcast(b.gep(data, [args[1]], inbounds=True), vector.as_pointer()), align=8)

    return lanes(array, types.int64), codegen


@intrinsic
def put_pairs(typingctx: Any, i: Any, j: Any, at: Any, index: Any, p: Any, k: Any, mask: Any) -> Any:
    """From place `at` on, the numbers index[p] in i and index[k + lane] in j for each lane that holds; the lower in i.

    Lanes are pressed together without a branch: with the hits taken one by one the search took half as long again.
    """
    narrow = ir.VectorType(_I32, WINDOW)
    target = ir.VectorType(ir.IntType(i.dtype.bitwidth), WINDOW)

    def codegen(context: Any, b: Any, sig: Any, args: Any) -> Any:
        def element(array: int, k: Any, kind: Any) -> Any:
            data = context.make_array(sig.args[array])(context, b, args[array]).data
            return b.bitcast(b.gep(data, [k], inbounds=True), kind.as_pointer())

        one = _splat(b, b.load(element(3, args[4], _I32)), WINDOW)
        other = b.load(element(3, args[5], narrow), align=4)
        below = b.icmp_signed("<", one, other)
        press = ir.FunctionType(narrow, [narrow, args[6].type, narrow])
        press = cgutils.get_or_insert_function(b.module, press, f"llvm.experimental.vector.compress.v{WINDOW}i32")
        bits = b.zext(b.bitcast(args[6], ir.IntType(WINDOW)), _I64)
        hits = lanes_below(b, b.ctpop(bits), WINDOW)
        for array, numbers in ((0, b.select(below, one, other)), (1, b.select(below, other, one))):
            numbers = b.call(press, [numbers, args[6], ir.Constant(narrow, ir.Undefined)])
            numbers = numbers if target == narrow else b.sext(numbers, target)
            alignment = ir.Constant(_I32, target.element.width // 8)
            _masked(b, "store", target, ir.VoidType(), [numbers, element(array, args[2], target), alignment, hits])
        return context.get_dummy_value()

    return types.void(i, j, types.int64, index, types.int64, types.int64, mask), codegen


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


@intrinsic
def prefetch(typingctx: Any, k: Any, arrays: Any) -> Any:
    """Asks for element k of each array, soon to be changed."""

    def codegen(context: Any, b: Any, sig: Any, args: Any) -> Any:
        for kind, array in zip(arrays, cgutils.unpack_tuple(b, args[1]), strict=True):
            data = context.make_array(kind)(context, b, array).data
            address = b.bitcast(b.gep(data, [args[0]]), ir.IntType(8).as_pointer())
            function = ir.FunctionType(ir.VoidType(), [address.type, _I32, _I32, _I32])
            function = cgutils.get_or_insert_function(b.module, function, "llvm.prefetch.p0")
            b.call(function, [address, *(ir.Constant(_I32, option) for option in (1, 3, 1))])
        return context.get_dummy_value()

    return types.void(types.int64, arrays), codegen

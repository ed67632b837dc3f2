"""Loads and stores of the search for contacts, and the prefetch of in_order.py."""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils

from .lanes import F64, I32, I64, Lanes, lanes_below, splat
from .memory import masked_move, pointer
from .options import intrinsic

# Three cells of a row seldom hold more balls than these: with eight, the search for contacts took a third longer.
WINDOW = 4


@intrinsic
def window(typingctx: Any, array: Any, k: Any) -> Any:
    """The values of WINDOW elements from k on; the array must not end before."""
    lanes = Lanes(WINDOW)

    def codegen(context: Any, b: Any, sig: Any, args: Any) -> Any:
        return b.load(pointer(context, b, array, args[0], args[1], ir.VectorType(F64, WINDOW)), align=8)

    return lanes(array, types.int64), codegen


@intrinsic
def put_pairs(typingctx: Any, i: Any, j: Any, at: Any, index: Any, p: Any, k: Any, mask: Any) -> Any:
    """From place `at` on, the numbers index[p] in i and index[k + lane] in j for each lane that holds; the lower in i.

    What is emitted, lane by lane:

        one, other = index[p], index[k + lane]
        low, high = min(one, other), max(one, other)
        i[at : at + hits] = low, pressed together where the mask holds     (a masked store of the first `hits` lanes)
        j[at : at + hits] = high, likewise

    There is no branch: with the hits taken one by one the search took half as long again.
    """
    narrow = ir.VectorType(I32, WINDOW)
    target = ir.VectorType(ir.IntType(i.dtype.bitwidth), WINDOW)

    def codegen(context: Any, b: Any, sig: Any, args: Any) -> Any:
        def element(array: int, k: Any, kind: Any) -> Any:
            return pointer(context, b, sig.args[array], args[array], k, kind)

        one = splat(b, b.load(element(3, args[4], I32)), WINDOW)
        other = b.load(element(3, args[5], narrow), align=4)
        below = b.icmp_signed("<", one, other)
        press = ir.FunctionType(narrow, [narrow, args[6].type, narrow])
        press = cgutils.get_or_insert_function(b.module, press, f"llvm.experimental.vector.compress.v{WINDOW}i32")
        bits = b.zext(b.bitcast(args[6], ir.IntType(WINDOW)), I64)
        hits = lanes_below(b, b.ctpop(bits), WINDOW)
        for array, numbers in ((0, b.select(below, one, other)), (1, b.select(below, other, one))):
            numbers = b.call(press, [numbers, args[6], ir.Constant(narrow, ir.Undefined)])
            numbers = numbers if target == narrow else b.sext(numbers, target)
            alignment = ir.Constant(I32, target.element.width // 8)
            masked_move(b, "store", target, ir.VoidType(), [numbers, element(array, args[2], target), alignment, hits])
        return context.get_dummy_value()

    return types.void(i, j, types.int64, index, types.int64, types.int64, mask), codegen


@intrinsic
def prefetch(typingctx: Any, k: Any, changed: Any, read: Any) -> Any:
    """Asks for element k of arrays that will soon be changed, and of others that will be read.

    Not of all as if they were changed: that takes a line away from all other processors, and where threads shared one
    mass for all balls, two took twice as long as one.
    """

    def codegen(context: Any, b: Any, sig: Any, args: Any) -> Any:
        for kinds, arrays, write in ((changed, args[1], 1), (read, args[2], 0)):
            for kind, array in zip(kinds, cgutils.unpack_tuple(b, arrays), strict=True):
                struct = context.make_array(kind)(context, b, array)
                (step,) = cgutils.unpack_tuple(b, struct.strides)
                if kind.layout == "C":
                    step = ir.Constant(step.type, kind.dtype.bitwidth // 8)
                start = b.bitcast(struct.data, ir.IntType(8).as_pointer())
                address = b.gep(start, [b.mul(args[0], step)], inbounds=True)
                function = ir.FunctionType(ir.VoidType(), [address.type, I32, I32, I32])
                function = cgutils.get_or_insert_function(b.module, function, "llvm.prefetch.p0")
                b.call(function, [address, *(ir.Constant(I32, option) for option in (write, 3, 1))])
        return context.get_dummy_value()

    return types.void(types.int64, changed, read), codegen

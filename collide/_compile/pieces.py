"""A kernel's range in pieces: what it does, emitted as code that any thread can run.

The loop over the pieces is emitted, not left to Numba, which optimises all code once more for each function around it:
by three functions more compiling took half as long again. Its arguments pass through memory, as another thread has
nothing else; a call of one pair takes what it took.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils

from .lanes import I64
from .options import intrinsic
from .team import ARGUMENTS, CODE, JOB_END, NEXT, SIZE, N, code_type, start


def _taken_apart(context: Any, b: Any, kind: Any, value: Any) -> list[Any]:
    """The values that a job needs of its arguments; of an array not all seven."""
    if isinstance(kind, types.BaseTuple):
        parts = zip(kind.types, cgutils.unpack_tuple(b, value), strict=True)
        return [leaf for its_kind, part in parts for leaf in _taken_apart(context, b, its_kind, part)]
    if isinstance(kind, types.Array):
        array = context.make_array(kind)(context, b, value)
        return [array.data, array.nitems, *cgutils.unpack_tuple(b, array.strides), array.parent]
    return [] if isinstance(kind, types.Callable) else [value]


def _put_together(context: Any, b: Any, kind: Any, leaves: Iterator[Any]) -> Any:
    """The reverse."""
    if isinstance(kind, types.BaseTuple):
        return context.make_tuple(b, kind, [_put_together(context, b, part, leaves) for part in kind.types])
    if isinstance(kind, types.Array):
        array = context.make_array(kind)(context, b)
        array.data, array.nitems, stride, array.parent = (next(leaves) for _ in range(4))
        array.shape, array.strides = cgutils.pack_array(b, [array.nitems]), cgutils.pack_array(b, [stride])
        array.itemsize = ir.Constant(array.itemsize.type, kind.dtype.bitwidth // 8)
        array.meminfo = cgutils.get_null_value(array.meminfo.type)
        return array._getvalue()
    return context.get_dummy_value() if isinstance(kind, types.Callable) else next(leaves)


@intrinsic
def in_pieces(typingctx: Any, look: Any, function: Any, arguments: Any, n: Any, seat: Any) -> Any:
    """The sum of function(begin, end, job, facts, arguments) over pieces that make up range(n).

    look(arguments) gives the facts, and whether the arguments are refused: then nothing is done, and -1 returned. Each
    thread looks itself, as to hand over what it has seen, or a dozen arrays once more, takes longer. The arguments are
    a tuple of numbers, arrays of one dimension, functions, and such tuples. `seat`: that of the call, 0 if it shall
    stay on its thread. What each thread runs:

        facts, is_refused = look(arguments)
        begin = n if is_refused else 0 if size >= n else add_to(next, size)
        while begin < n:
            found += function(begin, min(begin + size, n), job, facts, arguments)
            begin = n if size >= n else add_to(next, size)
        return -1 if is_refused else found
    """
    looks = look.get_call_type(typingctx, (arguments,), {})
    piece = types.int64, types.int64, types.int64, looks.return_type[0], arguments
    works = function.get_call_type(typingctx, piece, {})
    starter = typingctx.resolve_value_type(start)
    starts = starter.get_call_type(typingctx, (types.int64,) * 3, {})

    def emit(context: Any, i: Any, struct: Any) -> None:
        (job,) = context.call_conv.get_arguments(i.function)
        w = i.inttoptr(job, I64.as_pointer())
        from_there = i.inttoptr(i.load(cgutils.gep(i, w, ARGUMENTS)), struct.as_pointer())
        leaves = (i.load(cgutils.gep_inbounds(i, from_there, 0, k)) for k in range(len(struct.elements)))
        given = _put_together(context, i, arguments, leaves)
        facts, is_refused = cgutils.unpack_tuple(i, context.get_function(look, looks)(i, [given]))
        size, n = (i.load(cgutils.gep(i, w, k)) for k in (SIZE, N))
        nothing = ir.Constant(I64, 0)
        alone, place = i.icmp_signed(">=", size, n), i.ptrtoint(cgutils.gep(i, w, NEXT), I64)

        def take(otherwise: Any) -> Any:
            """The next piece; alone there is none but the first."""
            before, atomic, taken = i.block, i.append_basic_block("take"), i.append_basic_block("taken")
            i.cbranch(alone, taken, atomic)
            i.position_at_end(atomic)
            theirs = i.atomic_rmw("add", i.inttoptr(place, I64.as_pointer()), size, "seq_cst")
            i.branch(taken)
            i.position_at_end(taken)
            phi = i.phi(I64)
            phi.add_incoming(otherwise, before)
            phi.add_incoming(theirs, atomic)
            return phi

        first_piece, loop, body, over = (i.append_basic_block(name) for name in ("first", "loop", "body", "over"))
        refused_from = i.block
        i.cbranch(context.is_true(i, types.boolean, is_refused), over, first_piece)
        i.position_at_end(first_piece)
        first, first_from = take(nothing), i.block
        i.branch(loop)
        i.position_at_end(loop)
        begin, found = i.phi(I64), i.phi(I64)
        i.cbranch(i.icmp_signed("<", begin, n), body, over)
        i.position_at_end(body)
        beyond = i.add(begin, size)
        end = i.select(i.icmp_signed("<", beyond, n), beyond, n)
        its = context.get_function(function, works)(i, [begin, end, job, facts, given])
        more = i.add(found, context.cast(i, its, works.return_type, types.int64))
        following = take(n)
        for phi, value, again in ((begin, first, following), (found, nothing, more)):
            phi.add_incoming(value, first_from)
            phi.add_incoming(again, i.block)
        i.branch(loop)
        i.position_at_end(over)
        result = i.phi(I64)
        result.add_incoming(ir.Constant(I64, -1), refused_from)
        result.add_incoming(found, loop)
        context.call_conv.return_value(i, result)

    def codegen(context: Any, b: Any, sig: Any, args: Any) -> Any:
        leaves = _taken_apart(context, b, arguments, args[2])
        struct = ir.LiteralStructType([leaf.type for leaf in leaves])
        with b.goto_entry_block():
            place, job = b.alloca(struct), b.alloca(I64, JOB_END)
        for k, leaf in enumerate(leaves):
            b.store(leaf, cgutils.gep_inbounds(b, place, 0, k))
        code = ir.Function(b.module, code_type(context), b.module.get_unique_name(b.function.name + ".job"))
        code.linkage = "internal"
        code.attributes.add("noinline")  # there is one copy of the loop
        emit(context, ir.IRBuilder(code.append_basic_block("entry")), struct)
        b.store(b.ptrtoint(code, I64), cgutils.gep(b, job, CODE))
        b.store(b.ptrtoint(place, I64), cgutils.gep(b, job, ARGUMENTS))
        return context.get_function(starter, starts)(b, [b.ptrtoint(job, I64), *args[3:]])

    return types.int64(look, function, arguments, types.int64, types.int64), codegen

"""Memory as words of 64 bits, by address, and what several threads may do to one of them at once."""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba import types

from .lanes import I64
from .options import intrinsic

_WORD = types.int64
_ORDER = "seq_cst"


def _pointer(builder: Any, address: Any) -> Any:
    return builder.inttoptr(address, I64.as_pointer())


@intrinsic
def words(typingctx: Any, address: Any) -> Any:
    """The words from an address on."""
    return types.CPointer(_WORD)(_WORD), lambda context, b, sig, args: _pointer(b, args[0])


@intrinsic
def seen(typingctx: Any, address: Any) -> Any:
    """A word that other threads change."""
    return _WORD(_WORD), lambda context, b, sig, args: b.load_atomic(_pointer(b, args[0]), _ORDER, 8)


@intrinsic
def set_to(typingctx: Any, address: Any, value: Any) -> Any:
    """Sets a word that other threads look at."""

    def codegen(context: Any, b: Any, sig: Any, args: Any) -> Any:
        b.store_atomic(args[1], _pointer(b, args[0]), _ORDER, 8)
        return context.get_dummy_value()

    return types.void(_WORD, _WORD), codegen


@intrinsic
def add_to(typingctx: Any, address: Any, amount: Any) -> Any:
    """Adds to a word that other threads change; returns what it was before."""
    return _WORD(_WORD, _WORD), lambda context, b, sig, args: b.atomic_rmw("add", _pointer(b, args[0]), args[1], _ORDER)


@intrinsic
def exchange(typingctx: Any, address: Any, old: Any, new: Any) -> Any:
    """Sets a word to `new` if it is `old`; returns whether it was."""

    def codegen(context: Any, b: Any, sig: Any, args: Any) -> Any:
        return b.extract_value(b.cmpxchg(_pointer(b, args[0]), args[1], args[2], _ORDER, _ORDER), 1)

    return types.boolean(_WORD, _WORD, _WORD), codegen


@intrinsic
def pause(typingctx: Any) -> Any:
    """What a thread does that looks at a word again and again: other threads of its core get on meanwhile."""

    def codegen(context: Any, b: Any, sig: Any, args: Any) -> Any:
        nothing, arguments = ir.VoidType(), []
        if b.module.triple.startswith("x86_64"):
            name = "llvm.x86.sse2.pause"
        elif b.module.triple.startswith(("aarch64", "arm64")):
            name, arguments = "llvm.aarch64.hint", [ir.Constant(ir.IntType(32), 1)]  # yield
        else:
            return context.get_dummy_value()
        kind = ir.FunctionType(nothing, [a.type for a in arguments])
        function = b.module.globals.get(name) or ir.Function(b.module, kind, name)
        b.call(function, arguments)
        return context.get_dummy_value()

    return types.void(), codegen

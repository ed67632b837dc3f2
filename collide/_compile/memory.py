"""Lanes in and out of memory: columns of float64 or float32 on one side, float64 lanes on the other.

A column is an array of any step, or, for a scalar, an empty one whose value stands in `scalars`: one compiled kernel
serves every mix. A step takes as many pairs as fill a cache line of the outputs' storage, 8 or 16. Numba does not ask
whether arrays are aligned, so nothing is promised of them, but where a line is to stream.

Columns that adjoin in rows of two, as the components of vectors do, are taken apart and put together by whole lines;
those of other steps, of longer rows and of records, number by number.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils

from .._system.memory import CACHE_LINE
from .lanes import F64, I32, I64, Lanes, constant, lanes_below, out_of_line, splat
from .options import compiles, formula, intrinsic, rare

_SUFFIX = {"double": "f64", "float": "f32", "i32": "i32", "i64": "i64"}


def lanes_of(dtype: Any) -> Lanes:
    """The lanes that one step over storage of this dtype moves."""
    return Lanes(CACHE_LINE * 8 // dtype.bitwidth)


def width_of(outputs: Any) -> Any:
    """How many pairs a step takes, by its outputs."""


@compiles(width_of)
def _width_of(outputs: Any) -> Any:
    width = lanes_of(outputs.dtype.dtype).width
    return lambda outputs: width


def pointer(context: Any, builder: Any, array_type: Any, array: Any, k: Any, kind: Any) -> Any:
    """Element k of an array as an LLVM pointer to a value of this kind."""
    data = context.make_array(array_type)(context, builder, array).data
    return builder.bitcast(builder.gep(data, [k], inbounds=True), kind.as_pointer())


def masked_move(builder: Any, name: str, vector: Any, result: Any, args: list[Any]) -> Any:
    """A call of llvm.masked.load, .store, .gather or .scatter; lanes that are off touch no memory."""
    kind = f"v{vector.count}{_SUFFIX[str(vector.element)]}"
    function = ir.FunctionType(result, [a.type for a in args])
    name = f"llvm.masked.{name}.{kind}.{f'v{vector.count}' if 'er' in name else ''}p0"
    return builder.call(cgutils.get_or_insert_function(builder.module, function, name), args)


class _Column:
    """A column while code is emitted for it."""

    def __init__(self, context: Any, builder: Any, kind: Any, array: Any, k: Any, width: int) -> None:
        self._b, self._width = builder, width
        self._item = kind.dtype.bitwidth // 8
        self.element = F64 if kind.dtype == types.float64 else ir.FloatType()
        self.vector = ir.VectorType(self.element, width)
        struct = context.make_array(kind)(context, builder, array)
        (self._step,) = cgutils.unpack_tuple(builder, struct.strides)
        self.is_number = builder.icmp_signed("==", struct.nitems, ir.Constant(struct.nitems.type, 0))
        self._data, self._k = struct.data, k

    def has_step(self, numbers: int) -> Any:
        return self._b.icmp_signed("==", self._step, ir.Constant(I64, numbers * self._item))

    def line(self) -> Any:
        """The address of a step's numbers where there is no gap between them."""
        return self._b.bitcast(self._b.gep(self._data, [self._k], inbounds=True), self.vector.as_pointer())

    def beyond(self, numbers: int, kind: Any) -> Any:
        """The address so many numbers behind the first of a step."""
        return self._b.inttoptr(self._b.add(self._first(), ir.Constant(I64, numbers * self._item)), kind.as_pointer())

    def each(self) -> list[Any]:
        """The addresses of all numbers of a step."""
        place, places = self._first(), []
        for _ in range(self._width):
            places.append(self._b.inttoptr(place, self.element.as_pointer()))
            place = self._b.add(place, self._step)
        return places

    def _first(self) -> Any:
        return self._b.add(self._b.ptrtoint(self._data, I64), self._b.mul(self._k, self._step))

    def all(self) -> Any:
        """The addresses of all numbers of a step, as one vector."""
        kind = ir.VectorType(I64, self._width)
        offsets = self._b.mul(splat(self._b, self._step, self._width), ir.Constant(kind, list(range(self._width))))
        places = self._b.add(splat(self._b, self._first(), self._width), offsets)
        return self._b.inttoptr(places, ir.VectorType(self.element.as_pointer(), self._width))


def _either(builder: Any, condition: Any, this: Callable[[], Any], other: Callable[[], Any]) -> Any:
    """The value that comes by the way that is taken."""
    with builder.if_else(condition) as (yes, no):
        with yes:
            ways = [(this(), builder.block)]
        with no:
            ways.append((other(), builder.block))
    phi = builder.phi(ways[0][0].type)
    for value, block in ways:
        phi.add_incoming(value, block)
    return phi


def _merge(builder: Any, *ways: tuple[Any, Any]) -> Any:
    """The value that came by the way that was taken."""
    phi = builder.phi(ways[0][0].type)
    for value, block in ways:
        phi.add_incoming(value, block)
    return phi


@intrinsic
def load(typingctx: Any, columns: Any, scalars: Any, k: Any, n: Any, plain: Any, outputs: Any) -> Any:
    """Pairs k to k+n of every column; lanes past n hold ones, a valid pair. `plain`: see `is_plain`.

    What is emitted, for `width` lanes:

        if n == width:
            if plain: a whole line of each column but the last, which may be a number
            else:     of each column, by its step, a line, or every second number of two lines, or number by number
        else:         of each column the numbers below n

    as a masked load costs a full step a quarter of its time, and a branch a column a tenth.
    """
    lanes = lanes_of(outputs.dtype.dtype)
    width, half = lanes.width, lanes.width // 2
    wide = ir.VectorType(F64, width)

    def codegen(context: Any, b: Any, sig: Any, args: Any) -> Any:
        arrays, scalar_array, k, n, plain = args[:5]
        values = context.make_array(sig.args[1])(context, b, scalar_array).data
        given = cgutils.unpack_tuple(b, arrays)

        def widened(value: Any) -> Any:
            return value if value.type == wide else b.fpext(value, wide)

        def number(i: int) -> Any:
            return splat(b, b.load(b.gep(values, [ir.Constant(I32, i)])), width)

        def line(i: int, column: Any) -> Any:
            return widened(b.load(column.line(), align=1))

        def seconds(column: Any) -> Any:
            # The second load ends with the last number: nothing beyond a column may be read.
            both = [b.load(column.beyond(at, column.vector), align=1) for at in (0, width - 1)]
            picked = [2 * i if i < half else 2 * i + 1 for i in range(width)]
            return widened(b.shuffle_vector(*both, ir.Constant(ir.VectorType(I32, width), picked)))

        def one_by_one(column: Any) -> Any:
            value = ir.Constant(column.vector, ir.Undefined)
            for i, place in enumerate(column.each()):
                value = b.insert_element(value, b.load(place, align=1), ir.Constant(I32, i))
            return widened(value)

        def column(i: int) -> Any:
            return _Column(context, b, columns.dtype, given[i], k, width)

        def full(i: int) -> Any:
            c = column(i)

            def with_gaps() -> Any:
                return _either(b, c.has_step(2), lambda: seconds(c), lambda: one_by_one(c))

            def array() -> Any:
                return _either(b, c.has_step(1), lambda: line(i, c), with_gaps)

            return _either(b, c.is_number, lambda: number(i), array)

        def part(i: int) -> Any:
            c, mask = column(i), lanes_below(b, n, width)
            rest = ir.Constant(I32, 1), mask, constant(c.vector, 1.0)

            def array() -> Any:
                return _either(
                    b,
                    c.has_step(1),
                    lambda: masked_move(b, "load", c.vector, c.vector, [c.line(), *rest]),
                    lambda: masked_move(b, "gather", c.vector, c.vector, [c.all(), *rest]),
                )

            return _either(b, c.is_number, lambda: number(i), lambda: widened(array()))

        def last(i: int) -> Any:
            return _either(b, column(i).is_number, lambda: number(i), lambda: line(i, column(i)))

        *most, end = range(columns.count)
        with b.if_else(b.icmp_signed("==", n, ir.Constant(n.type, width))) as (whole, rest):
            with whole:
                with b.if_else(plain) as (straight, mixed):
                    with straight:
                        quick = [*(line(i, column(i)) for i in most), last(end)]
                        from_quick = b.block
                    with mixed:
                        branched = [full(i) for i in (*most, end)]
                        from_branched = b.block
                lines = [_merge(b, (x, from_quick), (y, from_branched)) for x, y in zip(quick, branched, strict=True)]
                from_whole = b.block
            with rest:
                parts = [part(i) for i in (*most, end)]
                from_part = b.block
        merged = [_merge(b, (x, from_whole), (y, from_part)) for x, y in zip(lines, parts, strict=True)]
        return context.make_tuple(b, sig.return_type, merged)

    kinds = columns, scalars, types.int64, types.int64, types.boolean, outputs
    return types.UniTuple(lanes, columns.count)(*kinds), codegen


@intrinsic
def store(typingctx: Any, outputs: Any, k: Any, n: Any, values: Any, streaming: Any, rows: Any) -> Any:
    """The values of pairs k to k+n into the outputs. A full, aligned line may stream. `rows`: see `rows_of`."""
    width = lanes_of(outputs.dtype.dtype).width

    def codegen(context: Any, b: Any, sig: Any, args: Any) -> Any:
        arrays, k, n, lanes_out, streaming, rows = args
        columns = [_Column(context, b, outputs.dtype, u, k, width) for u in cgutils.unpack_tuple(b, arrays)]
        vector = columns[0].vector
        given = cgutils.unpack_tuple(b, lanes_out)
        given = [value if value.type == vector else b.fptrunc(value, vector) for value in given]

        def has(bit: int) -> Any:
            return b.trunc(b.lshr(rows, ir.Constant(I64, bit)), ir.IntType(1))

        def move(lines: list[tuple[Any, Any]]) -> None:
            with b.if_else(streaming) as (stream, plain):
                with stream:
                    for value, place in lines:
                        hint = b.module.add_metadata([ir.Constant(I32, 1)])
                        b.store(value, place, align=CACHE_LINE).set_metadata("nontemporal", hint)
                with plain:
                    for value, place in lines:
                        b.store(value, place, align=1)

        def rows_of_two(i: int) -> None:
            lines = []
            for line in (0, 1):
                order = [(line * width + lane) // 2 + (lane % 2) * width for lane in range(width)]
                both = b.shuffle_vector(given[i], given[i + 1], ir.Constant(ir.VectorType(I32, width), order))
                lines.append((both, columns[i].beyond(line * width, vector)))
            move(lines)

        def alone(i: int) -> None:
            with b.if_else(columns[i].has_step(1)) as (line, gaps):
                with line:
                    move([(given[i], columns[i].line())])
                with gaps:
                    for lane, place in enumerate(columns[i].each()):
                        b.store(b.extract_element(given[i], ir.Constant(I32, lane)), place, align=1)

        with b.if_else(b.icmp_signed("==", n, ir.Constant(n.type, width))) as (whole, part):
            with whole, b.if_else(b.icmp_signed("==", rows, ir.Constant(I64, 0))) as (straight, mixed):
                with straight:
                    move([(value, column.line()) for value, column in zip(given, columns, strict=True)])
                with mixed:
                    for i in range(len(columns)):
                        begins = has(i + 1) if i + 1 < len(columns) else ir.Constant(ir.IntType(1), 0)
                        with b.if_else(begins) as (together, other):
                            with together:
                                if i + 1 < len(columns):
                                    rows_of_two(i)
                            with other, b.if_then(b.not_(has(i)) if i else ir.Constant(ir.IntType(1), 1)):
                                alone(i)
            with part:
                mask = lanes_below(b, n, width)
                for value, column in zip(given, columns, strict=True):
                    with b.if_else(column.has_step(1)) as (line, gaps):
                        align = ir.Constant(I32, 1)
                        with line:
                            masked_move(b, "store", vector, ir.VoidType(), [value, column.line(), align, mask])
                        with gaps:
                            masked_move(b, "scatter", vector, ir.VoidType(), [value, column.all(), align, mask])
        return context.get_dummy_value()

    kinds = outputs, types.int64, types.int64, values, types.boolean, types.int64
    return types.void(*kinds), codegen


@rare
def rows_of(outputs: Any) -> int:
    """How the outputs lie: 0 all without gaps; else bit 0, and bit c+1 where number c and the next are rows of two."""
    out_of_line()
    rows, c, item = 0, 0, outputs[0].itemsize
    while c < len(outputs):
        u, w = outputs[c], outputs[min(c + 1, len(outputs) - 1)]
        if u.strides[0] != item:
            rows |= 1
            if u.strides[0] == 2 * item and w.strides[0] == 2 * item and address(w) == address(u) + item:
                rows |= 2 << c
                c += 1
        c += 1
    return rows


@rare
def lead(outputs: Any, start: int, rows: int) -> int:
    """Pairs from `start` to where a cache line begins in all outputs; -1 where they do not agree on it."""
    out_of_line()
    item, head = outputs[0].itemsize, 0
    for c in range(len(outputs)):
        if c > 0 and (rows >> c) & 1:
            continue  # it lies in the lines of the one before
        step = outputs[c].strides[0]
        own, place = 0, address(outputs[c]) + start * step
        while own * item < CACHE_LINE and (place + own * step) % CACHE_LINE != 0:
            own += 1
        if own * item == CACHE_LINE or (c > 0 and own != head) or (step != item and not (rows >> (c + 1)) & 1):
            return -1
        head = own
    return head


@intrinsic
def address(typingctx: Any, array: Any) -> Any:
    """Of the first element, as a signed integer: with one that has no sign Numba would compute in float64."""

    def codegen(context: Any, b: Any, sig: Any, args: Any) -> Any:
        return b.ptrtoint(context.make_array(array)(context, b, args[0]).data, I64)

    return types.int64(array), codegen


@intrinsic
def _is_like(typingctx: Any, array: Any, ours: Any) -> Any:
    """Whether an array of the caller's is of the class and the byte order of one of ours.

    Numba does not tell: it takes a read-only byte-swapped array for a native one, and a subclass for its base. To ask
    it here, of the objects as every C extension of NumPy's sees them, takes a nanosecond; Python needs 0.05 us an
    array, a sixth of a call of one pair in all (test_kernels_know_their_arrays).
    """
    header = object.__basicsize__
    descriptor = header + 5 * 8  # data, nd, dimensions, strides and base come first
    byte_order = header + 8 + 2  # the class of the numbers, kind and type come first

    def codegen(context: Any, b: Any, sig: Any, args: Any) -> Any:
        def look(place: Any, offset: int, kind: Any) -> Any:
            return b.load(b.inttoptr(b.add(place, ir.Constant(I64, offset)), kind.as_pointer()))

        seen = []
        for kind, array in zip(sig.args, args, strict=True):
            parent = b.ptrtoint(context.make_array(kind)(context, b, array).parent, I64)
            dtype = look(parent, descriptor, I64)
            seen.append((look(parent, header - 8, I64), look(dtype, byte_order, ir.IntType(8))))
        (kind, order), (our_kind, our_order) = seen
        return b.and_(b.icmp_signed("==", kind, our_kind), b.icmp_signed("==", order, our_order))

    return types.boolean(array, ours), codegen


@rare
def overlap(columns: Any, outputs: Any, scalars: Any, n_numbers: int) -> int:
    """How the outputs lie to the columns and to each other: 0 apart, 1 some in place; -1 in any other way.

    -1 as well where they are not of one length, but for so many empty columns, which stand for numbers, and where one
    is not what Numba takes it for.
    """
    out_of_line()
    for a in columns:
        n_numbers -= a.size == 0
        if not _is_like(a, scalars):
            return -1
    if n_numbers != 0:
        return -1
    n, relation = outputs[0].size, 0
    for i in range(len(outputs)):
        u = outputs[i]
        if not _is_like(u, scalars) or u.size != n or (n > 1 and abs(u.strides[0]) < u.itemsize):
            return -1
        for a in columns:
            if a.size != 0:
                met = -1 if a.size != n else _meet(a, u)
                if met < 0:
                    return -1
                relation |= met
        for k in range(i):
            if _meet(outputs[k], u) != 0:
                return -1
    return relation


@formula
def _meet(a: Any, u: Any) -> int:
    """Of two arrays of one length: 0 they share no element, 1 each of a is that of u with its number, -1 otherwise."""
    n, step, start, place = u.size, u.strides[0], address(a), address(u)
    reach, extent = (n - 1) * a.strides[0], (n - 1) * step
    low, lowest = start + min(reach, 0), place + min(extent, 0)
    if low >= lowest + abs(extent) + u.itemsize or lowest >= low + abs(reach) + a.itemsize:
        return 0
    if start == place and reach == extent and a.itemsize == u.itemsize:
        return 1
    if reach == extent:
        between = (place - start) % abs(step)  # as columns of rows
        if between >= a.itemsize and between + u.itemsize <= abs(step):
            return 0
    return -1


@rare
def is_plain(columns: Any) -> bool:
    """Whether all columns are arrays without gaps; only the last may be a number."""
    out_of_line()
    others = 0
    for c in columns:
        others += c.size == 0 or c.strides[0] != c.itemsize
    last = columns[-1]
    return others == 0 or (others == 1 and last.size == 0)

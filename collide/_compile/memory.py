"""Lanes in and out of memory: columns of float64 or float32 on one side, float64 lanes on the other.

A column is an array of any step, or, for a scalar, an empty one whose value stands in `scalars`: one compiled kernel
serves every mix. A step takes as many pairs as fill a cache line of the outputs' storage, 8 or 16. Numba does not ask
whether arrays are aligned, so nothing is promised of them, but where a line is to stream.

Columns that adjoin in rows of two or three, as the components of vectors do, are taken apart and put together by whole
lines; those of other steps, of longer rows and of records, number by number. Each column of rows of two is read by
itself, and those of rows of three all at once, where the kernel is one of vectors in space. To take lines of other rows
apart for each column was no gain: columns of rows of three took 6 %, of rows of four 20 % longer, and those of two 6 %
as well, by more code in the loop. Nor was it to gather a block of each column before the loop: from memory that took
three times as long.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils

from .._system.memory import CACHE_LINE
from .lanes import F64, I32, I64, Lanes, constant, lanes_below, splat
from .options import compiles, intrinsic

# The columns that may begin rows of three, by how many there are: only the forms in space have so many.
_VECTORS = {12: (2, 5, 8), 7: (0, 3)}
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

    def is_followed_by(self, others: list[_Column]) -> Any:
        """Whether these are the other columns of the rows of which this is the first."""
        b, found = self._b, self.has_step(1 + len(others))
        for k, other in enumerate(others, 1):
            place = b.add(self.start(), ir.Constant(I64, k * self._item))
            beside = b.icmp_signed("==", other.start(), place)
            found = b.and_(found, b.and_(beside, other.has_step(1 + len(others))))
        return found

    def start(self) -> Any:
        """The address of the column's first number, as an integer."""
        return self._b.ptrtoint(self._data, I64)

    def each(self) -> list[Any]:
        """The addresses of all numbers of a step."""
        place, places = self._first(), []
        for _ in range(self._width):
            places.append(self._b.inttoptr(place, self.element.as_pointer()))
            place = self._b.add(place, self._step)
        return places

    def _first(self) -> Any:
        return self._b.add(self.start(), self._b.mul(self._k, self._step))

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
    return _merge(builder, *ways)


def _merge(builder: Any, *ways: tuple[Any, Any]) -> Any:
    """The value that came by the way that was taken."""
    phi = builder.phi(ways[0][0].type)
    for value, block in ways:
        phi.add_incoming(value, block)
    return phi


def _picked(builder: Any, lines: list[Any], places: list[int]) -> Any:
    """Of three vectors laid end to end the elements of these places, as one."""
    width = len(places)
    from_two = [k if k < 2 * width else 0 for k in places]
    and_third = [i if k < 2 * width else k - width for i, k in enumerate(places)]
    kind = ir.VectorType(I32, width)
    both = builder.shuffle_vector(*lines[:2], ir.Constant(kind, from_two))
    return builder.shuffle_vector(both, lines[2], ir.Constant(kind, and_third))


@intrinsic
def load(typingctx: Any, columns: Any, scalars: Any, k: Any, n: Any, plain: Any, outputs: Any) -> Any:
    """Pairs k to k+n of every column; lanes past n hold ones, a valid pair. `plain`: see arrays.py.

    What is emitted, for `width` lanes:

        if n == width:
            if plain: a whole line of each column but the last, which may be a number
            else:     of each column, by its step, a line, or every second number of two lines, or number by number;
                      of three that adjoin in rows, three lines
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

        def line(column: Any) -> Any:
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
                return _either(b, c.has_step(1), lambda: line(c), with_gaps)

            return _either(b, c.is_number, lambda: number(i), array)

        def branched() -> list[Any]:
            values: list[Any] = []
            while len(values) < columns.count:
                i = len(values)
                values += threes(i) if i in _VECTORS.get(columns.count, ()) else [full(i)]
            return values

        def threes(i: int) -> list[Any]:
            first, *others = (column(k) for k in range(i, i + 3))
            with b.if_else(first.is_followed_by(others)) as (rows, apart):
                with rows:
                    lines = [b.load(first.beyond(k * width, first.vector), align=1) for k in range(3)]
                    picked = [widened(_picked(b, lines, [*range(k, 3 * width, 3)])) for k in range(3)]
                    from_rows = b.block
                with apart:
                    single = [full(k) for k in range(i, i + 3)]
                    from_apart = b.block
            return [_merge(b, (x, from_rows), (y, from_apart)) for x, y in zip(picked, single, strict=True)]

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
            return _either(b, column(i).is_number, lambda: number(i), lambda: line(column(i)))

        *most, end = range(columns.count)
        with b.if_else(b.icmp_signed("==", n, ir.Constant(n.type, width))) as (whole, rest):
            with whole:
                with b.if_else(plain) as (straight, mixed):
                    with straight:
                        quick = [*(line(column(i)) for i in most), last(end)]
                        from_quick = b.block
                    with mixed:
                        mixture = branched()
                        from_mixture = b.block
                lines = [_merge(b, (x, from_quick), (y, from_mixture)) for x, y in zip(quick, mixture, strict=True)]
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
    """The values of pairs k to k+n into the outputs. A full, aligned line may stream. `rows`: see arrays.py."""
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

        def rows_of_three(i: int) -> None:
            orders = ([lane % 3 * width + lane // 3 for lane in range(k * width, (k + 1) * width)] for k in range(3))
            places = (columns[i].beyond(k * width, vector) for k in range(3))
            move([(_picked(b, given[i : i + 3], order), place) for order, place in zip(orders, places, strict=True)])

        def alone(i: int) -> None:
            with b.if_else(columns[i].has_step(1)) as (line, gaps):
                with line:
                    move([(given[i], columns[i].line())])
                with gaps:
                    for lane, place in enumerate(columns[i].each()):
                        b.store(b.extract_element(given[i], ir.Constant(I32, lane)), place, align=1)

        def by_twos(some: range) -> None:
            for i in some:
                begins = has(i + 1) if i + 1 < len(columns) else ir.Constant(ir.IntType(1), 0)
                with b.if_else(begins) as (together, other):
                    with together:
                        if i + 1 < len(columns):
                            rows_of_two(i)
                    with other, b.if_then(b.not_(has(i)) if i else ir.Constant(ir.IntType(1), 1)):
                        alone(i)

        def by_threes() -> None:
            for i in range(0, len(columns), 3):
                with b.if_else(has(i + 9)) as (together, others):
                    with together:
                        rows_of_three(i)
                    with others:
                        by_twos(range(i, i + 3))

        with b.if_else(b.icmp_signed("==", n, ir.Constant(n.type, width))) as (whole, part):
            with whole, b.if_else(b.icmp_signed("==", rows, ir.Constant(I64, 0))) as (straight, mixed):
                with straight:
                    move([(value, column.line()) for value, column in zip(given, columns, strict=True)])
                with mixed:
                    if len(columns) % 3:
                        by_twos(range(len(columns)))
                    else:
                        by_threes()
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

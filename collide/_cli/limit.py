"""The memory limit: kernels that load every column and store every output of a batch, and compute next to nothing.

Yardsticks for the demo and the benchmarks, under the same facade and threads as the real kernels.
"""

from __future__ import annotations

from typing import Any

from .._compile.arrays import is_plain, lead, rows_of
from .._compile.components import each
from .._compile.memory import load, store, width_of
from .._compile.options import formula
from .._compile.pieces import in_pieces
from .._pairs.forms import FORMS, Form, batch_kernels
from .._pairs.loop import STREAM_BYTES


@formula
def _first(x: Any, y: Any) -> Any:
    return x


@formula
def _move(
    columns: Any, outputs: Any, scalars: Any, numbers: int, n: int, seat: int, approaching: bool, nan: bool
) -> int:
    found: int = in_pieces(_look, _move_piece, (columns, outputs, scalars), n, seat)
    return found


@formula
def _look(arguments: Any) -> Any:
    columns, outputs, _ = arguments
    may_stream = outputs[0].size * outputs[0].itemsize >= STREAM_BYTES
    return (rows_of(outputs), is_plain(columns), may_stream), False


@formula
def _move_piece(start: int, stop: int, job: int, lie: Any, arguments: Any) -> int:
    (columns, outputs, scalars), (rows, plain, may_stream) = arguments, lie
    width = width_of(outputs)
    head = lead(outputs, start, rows)
    streaming = may_stream and head >= 0
    k = start
    n = min(head if head > 0 else width, stop - start)
    while k < stop:
        if plain and rows == 0 and n == width:  # as in the loop of a batch
            end = stop - (stop - k) % width
            while k < end:
                _step(columns, outputs, scalars, k, width, True, streaming, 0)
                k += width
        else:
            _step(columns, outputs, scalars, k, n, plain, streaming, rows)
            k += n
        n = min(width, stop - k)
    return 0


@formula
def _step(columns: Any, outputs: Any, scalars: Any, k: int, n: int, plain: bool, streaming: bool, rows: int) -> None:
    # A sum, only because the compiler leaves out a load whose value goes nowhere.
    values = load(columns, scalars, k, n, plain, outputs)
    total = values[0]
    for value in values[1:]:
        total = total + value
    store(outputs, k, n, each(_first, total, outputs), streaming, rows)


def _limit(form: Form) -> Form:
    return form._replace(kernels=batch_kernels(f"{form.name}_bytes", len(form.columns), len(form.outputs), _move))


LIMITS = {name: _limit(form) for name, form in FORMS.items()}

"""Arrow tables: a RecordBatch or Table in, the same with the velocities after the collisions out. Needs pyarrow.

It is what Spark's mapInArrow, Ray Data, Polars, DuckDB and Dask DataFrame take.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, TypeVar

try:
    import pyarrow as pa
except ModuleNotFoundError:
    raise ModuleNotFoundError("collide.arrow needs pyarrow: pip install pyarrow", name="pyarrow") from None

from ._tables import by_name
from ._tables.arrow_batches import from_numpy, no_rows, to_numpy
from .errors import InvalidPairError

__all__ = ["resolve"]

Data = TypeVar("Data", pa.RecordBatch, pa.Table)


def resolve(
    data: Data,
    form: str | None = None,
    columns: Mapping[str, str] | None = None,
    *,
    restitution: float | None = None,
    approaching_only: bool = False,
    invalid: str = "raise",
) -> Data:
    """The table with the velocities after the collisions in columns added at its end, a pair a row.

    data: a pyarrow RecordBatch or Table. The columns of its form have one of the types bool, integer, halffloat,
        float and double and no nulls; they are read where they lie, without a copy (bool apart). All columns of the
        input, and its metadata, are in the result, sharing its memory.
    form: "1d": m1, m2, v1, v2 give u1, u2; "2d": m1, m2, v1x, v1y, v2x, v2y, nx, ny give u1x, u1y, u2x, u2y;
        "3d": these and v1z, v2z, nz give u1z and u2z as well; "polar": m1, m2, v1, theta1, v2, theta2, phi give u1x,
        u1y, u2x, u2y. None: the one whose columns are there. Each may have a column restitution. The equations and
        units are those of `resolve_1d`, `resolve_2d`, `resolve_3d`, `resolve_polar`.
    columns: the names of columns that are called otherwise, by these names; of added ones too.
    restitution: e, finite and >= 0, for all pairs. None: the column restitution, or 1 where there is none.
    approaching_only, invalid: as for the batch functions. The row of an invalid pair is its `index`.

    Added columns are of type float where np.result_type of the columns is float32 or float16, else double.

    Raises InvalidPairError as said; ValueError for columns that are missing, double, there already, or with nulls, and
    for an unknown form; TypeError for other types and other data.

    >>> table = pa.table({"mass": [0.5, 0.5], "m2": [3.5, 3.5], "v1": [4.0, 8.0], "v2": [0.0, 0.0]})
    >>> collide.arrow.resolve(table, columns={"m1": "mass"}).select(["u1", "u2"]).to_pydict()
    {'u1': [-3.0, -6.0], 'u2': [1.0, 2.0]}
    """
    if not isinstance(data, pa.RecordBatch | pa.Table):
        raise TypeError(f"data is of type {type(data).__name__}: must be a pyarrow RecordBatch or Table")
    options = by_name.options(restitution, approaching_only, invalid)
    chosen = by_name.choose(data.schema.names, form, columns, options)
    batches = data.to_batches() if isinstance(data, pa.Table) else [data]
    results: list[list[Any]] = [[] for _ in chosen.outputs]
    start, errors = 0, []
    for batch in batches or [no_rows(data.schema, chosen)]:
        arrays = to_numpy(batch, chosen, start)
        _, outputs, error = by_name.results_of(chosen, arrays, options)
        for pieces, u in zip(results, outputs, strict=True):
            pieces.append(from_numpy(u))
        if error:
            errors.append(InvalidPairError((start + error.index[0],), error.count, error.reason))
        start += batch.num_rows
    if errors and invalid == "raise":
        raise InvalidPairError(errors[0].index, sum(error.count for error in errors), errors[0].reason)
    for name, pieces in zip(chosen.outputs, results, strict=True):
        data = data.append_column(name, pa.chunked_array(pieces) if isinstance(data, pa.Table) else pieces[0])
    return data

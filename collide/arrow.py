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
from ._typing import Invalid
from .errors import InvalidPairError

__all__ = ["resolve"]


def __dir__() -> list[str]:
    return __all__


Data = TypeVar("Data", pa.RecordBatch, pa.Table)


def resolve(
    data: Data,
    form: str | None = None,
    columns: Mapping[str, str] | None = None,
    *,
    restitution: float | None = None,
    approaching_only: bool = False,
    invalid: Invalid = "raise",
) -> Data:
    """Compute the velocities after the collisions of a table, a pair a row, and add them as columns at its end.

    The equations are those of `collide.resolve_1d`, `resolve_2d`, `resolve_3d` and `resolve_polar`, to the bit.

    Parameters
    ----------
    data : pyarrow.RecordBatch or pyarrow.Table
        The columns of its form have one of the types bool, integer, halffloat, float and double and no nulls, in any
        consistent set of units, angles in radians; they are read where they lie, without a copy (bool apart).
    form : {"1d", "2d", "3d", "polar"}, optional
        "1d": m1, m2, v1, v2 give u1, u2. "2d": m1, m2, v1x, v1y, v2x, v2y, nx, ny give u1x, u1y, u2x, u2y. "3d": these
        and v1z, v2z, nz give u1z and u2z as well. "polar": m1, m2, v1, theta1, v2, theta2, phi give u1x, u1y, u2x, u2y.
        Each may have a column restitution. By default it is the one whose columns are there.
    columns : mapping of str to str, optional
        The names of columns that are called otherwise, by those above; of added ones too.
    restitution : float, optional
        Coefficient of restitution e of all pairs, finite and >= 0: 1 is elastic. Above 1 a collision adds energy. By
        default it is the column restitution, or 1 where there is none.
    approaching_only : bool, optional
        True leaves as they are the pairs that do not approach ((v1-v2).n <= 0), two immovable balls among them.
    invalid : {"raise", "keep", "nan"}, optional
        What happens to a pair that breaks a rule of `collide.resolve_2d`, or whose result is too large for its type.
        "raise": InvalidPairError is raised, and there is no table. "keep": it keeps its velocities. "nan": it gets NaN.

    Returns
    -------
    pyarrow.RecordBatch or pyarrow.Table
        As `data`: all its columns and its metadata, sharing its memory, and the results. These are of type float where
        np.result_type of the columns is float32 or float16, else double.

    Raises
    ------
    InvalidPairError
        As said under `invalid`; its `index` is the row. It is a ValueError.
    ValueError
        For columns that are missing, double, there already, or with nulls, an unknown `form`, a name in `columns` that
        no form has, a bad `restitution`, an unknown `invalid`.
    TypeError
        For columns of other types, and other data.

    See Also
    --------
    collide.resolve_2d : Its rules, and how exact it is.

    Examples
    --------
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

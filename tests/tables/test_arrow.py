"""Arrow tables: the same numbers as the batch functions give, no copies, and what else takes Arrow takes it."""

from typing import Any

import dask.dataframe as dd
import duckdb
import numpy as np
import pandas as pd
import polars as pl
import pyarrow as pa
import pytest
import xarray as xr

import collide
import collide.arrow
from collide._pairs import execution
from collide._tables import by_name
from tests.helpers.tables import FORMS, LINE, PLANE, POLAR, RNG, SPACE, N

pytestmark = pytest.mark.fast


def assert_resolved(data, columns, expected):
    assert data.schema.names == [*columns, *expected._fields]
    for name, u in expected._asdict().items():
        np.testing.assert_array_equal(data.column(name).to_numpy(zero_copy_only=False), u, strict=True)


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("make", [pa.table, pa.record_batch])
def test_result_is_that_of_the_batch_function(form, make):
    columns, function = FORMS[form]
    for asked in (None, form):
        result = collide.arrow.resolve(make(columns), asked)
        assert type(result) is type(make(columns))
        assert_resolved(result, columns, function(**columns))


def test_chunks_of_a_table_are_resolved_as_they_lie():
    parts = [
        pa.table({name: c[part] for name, c in PLANE.items()}) for part in (slice(0, 1), slice(1, 400), slice(400, N))
    ]
    table = pa.concat_tables(parts)
    # One column in chunks of its own.
    ny = pa.chunked_array([PLANE["ny"][:123], PLANE["ny"][123:]])
    result = collide.arrow.resolve(table.set_column(7, "ny", ny))
    assert_resolved(result, PLANE, collide.resolve_2d(**PLANE))
    assert result.column("u1x").num_chunks == 4


def test_slices():
    table = pa.table(PLANE).slice(100, 300)
    assert_resolved(
        collide.arrow.resolve(table), PLANE, collide.resolve_2d(**{k: c[100:400] for k, c in PLANE.items()})
    )


@pytest.mark.parametrize("make", [pa.table, pa.record_batch])
def test_no_rows(make):
    result = collide.arrow.resolve(make({name: c[:0] for name, c in LINE.items()}))
    assert result.num_rows == 0
    assert result.schema.names == [*LINE, "u1", "u2"]
    none = pa.table({name: pa.chunked_array([], pa.float32()) for name in LINE})
    assert collide.arrow.resolve(none).schema.field("u1").type == pa.float32()


@pytest.mark.parametrize(
    ("kinds", "result"),
    [
        ([pa.float32()] * 4, pa.float32()),
        ([pa.float16(), pa.float32(), pa.float32(), pa.float16()], pa.float32()),
        ([pa.float64(), pa.float32(), pa.float32(), pa.float32()], pa.float64()),
        ([pa.int8(), pa.uint64(), pa.int32(), pa.bool_()], pa.float64()),
    ],
)
def test_types(kinds, result):
    arrays = {name: pa.array(np.arange(1, 6), pa.int64()).cast(kind) for name, kind in zip(LINE, kinds, strict=True)}
    resolved = collide.arrow.resolve(pa.table(arrays))
    expected = collide.resolve_1d(*(a.to_numpy(zero_copy_only=False) for a in arrays.values()))
    assert resolved.schema.field("u2").type == result
    np.testing.assert_array_equal(resolved["u2"].to_numpy(), expected.u2)


def test_nothing_is_copied(monkeypatch):
    """What the kernel reads and writes lies where the columns lie."""
    seen = []
    attempt = execution.attempt

    def looking(form, inputs, *rest):
        outputs, error = attempt(form, inputs, *rest)
        seen.append([a.ctypes.data for a in (*inputs[:-1], *outputs)])
        return outputs, error

    monkeypatch.setattr(execution, "attempt", looking)
    batch = pa.record_batch(PLANE)
    result = collide.arrow.resolve(batch)
    assert seen == [[column.buffers()[1].address for column in result.columns]]
    assert [c.buffers()[1].address for c in batch.columns] == seen[0][:8]


def test_metadata_and_other_columns_stay():
    fields = [pa.field(name, pa.float64(), metadata={"unit": "kg"}) for name in LINE]
    schema = pa.schema([pa.field("id", pa.string()), *fields], metadata={"from": "here"})
    table = pa.table([pa.array(["a", None] * (N // 2)), *LINE.values()], schema=schema)
    result = collide.arrow.resolve(table)
    assert result.select(table.column_names).equals(table, check_metadata=True)
    assert result.schema.metadata == {b"from": b"here"}
    batch = table.to_batches()[0]
    assert collide.arrow.resolve(batch).select(table.column_names).equals(batch, check_metadata=True)


def test_names_options_and_restitution():
    e = RNG.uniform(0.0, 1.0, N)
    renamed = {{"m1": "mass a"}.get(name, name): column for name, column in LINE.items()}
    table = pa.table({**renamed, "restitution": e, "e": 0.5 * e})
    names = {"m1": "mass a", "u2": "after"}
    result = collide.arrow.resolve(table, columns=names, approaching_only=True)
    expected = collide.resolve_1d(**LINE, restitution=e, approaching_only=True)
    np.testing.assert_array_equal(result["after"], expected.u2)
    result = collide.arrow.resolve(table, columns={**names, "restitution": "e"})
    np.testing.assert_array_equal(result["u1"], collide.resolve_1d(**LINE, restitution=0.5 * e).u1)
    result = collide.arrow.resolve(table, columns=names, restitution=0)
    np.testing.assert_array_equal(result["u1"], collide.resolve_1d(**LINE, restitution=0.0).u1)


def test_an_invalid_pair_is_named_by_its_row_in_the_table():
    m2 = np.where(np.isin(np.arange(N), (642, 643, 999)), -1.0, LINE["m2"])
    table = pa.concat_tables([pa.table({**LINE, "m2": m2}).slice(k, 250) for k in range(0, N, 250)])
    with pytest.raises(collide.InvalidPairError, match=r"pair 642: m2 = -1.0: .* \(3 invalid pairs in all\)") as raised:
        collide.arrow.resolve(table)
    assert (raised.value.index, raised.value.count) == ((642,), 3)
    for rule in ("keep", "nan"):
        expected = collide.resolve_1d(**{**LINE, "m2": m2}, invalid=rule)
        np.testing.assert_array_equal(collide.arrow.resolve(table, invalid=rule)["u1"], expected.u1)


WRONG: dict[str, tuple[type[Exception], dict[str, Any], str]] = {
    "data": (TypeError, {"data": {"m1": [1.0]}}, "data is of type dict"),
    "form": (ValueError, {"form": "cartesian"}, "form = 'cartesian': must be None or one of '1d', '2d', '3d', 'polar'"),
    "missing": (ValueError, {"form": "polar"}, "missing column theta1, theta2, phi"),
    "missing, of no form": (ValueError, {"columns": {"m1": "x"}}, "missing column x"),
    "unknown argument": (ValueError, {"columns": {"mass": "m1"}}, "'mass' is not among m1, m2"),
    "no name": (TypeError, {"columns": {"m1": 3}}, "'m1': 3 is no name"),
    "there already": (ValueError, {"columns": {"u1": "v1"}}, "column v1: is there already"),
    "twice": (ValueError, {"columns": {"u1": "u", "u2": "u"}}, "column u: is there already"),
    "restitution": (ValueError, {"restitution": -1}, "restitution = -1: must be None or a finite number"),
    "true": (ValueError, {"restitution": True}, "restitution = True"),
    "missing restitution": (ValueError, {"columns": {"restitution": "e"}}, "missing column e"),
    "invalid": (ValueError, {"invalid": "ignore"}, "invalid = 'ignore'"),
    "approaching_only": (TypeError, {"approaching_only": 1}, "approaching_only = 1"),
}


@pytest.mark.parametrize("case", WRONG)
def test_wrong_arguments(case):
    kind, arguments, words = WRONG[case]
    with pytest.raises(kind) as raised:
        collide.arrow.resolve(**{"data": pa.table(LINE), **arguments})
    assert words in str(raised.value)


@pytest.mark.parametrize(
    ("larger", "smaller", "form", "other"), [(SPACE, PLANE, "3d", "2d"), (POLAR, LINE, "polar", "1d")]
)
def test_a_form_is_not_taken_for_the_smaller_one_that_it_contains(larger, smaller, form, other):
    """Any one of the columns that only the larger has tells; the smaller has to be asked for."""
    own = [name for name in larger if name not in smaller]
    for column in own:
        table = pa.table(smaller | {column: larger[column]})
        missing = ", ".join(name for name in own if name != column)
        said = rf'^missing column {missing} \(of the {form} form\); form="{other}" \(--form {other}\) takes'
        with pytest.raises(by_name.TableError, match=said):
            collide.arrow.resolve(table)
        expected = FORMS[other][1](**smaller)
        assert_resolved(collide.arrow.resolve(table, other), table.schema.names, expected)


def test_names_that_are_given_tell_which_form_is_meant():
    table = pa.table(LINE | {"phi": POLAR["phi"]})
    for called in {"u1": "after"}, {"m2": "phi"}:  # which only the form on a line has, or whose place is taken
        columns = {name: table[called.get(name, name)].to_numpy() for name in LINE}
        resolved = collide.arrow.resolve(table, columns=called)
        np.testing.assert_array_equal(resolved[called.get("u1", "u1")], collide.resolve_1d(**columns).u1)
    plane = {"v1y": "v1z", "v2y": "v2z", "ny": "nz"}  # that of x and z
    with pytest.raises(ValueError, match="has the columns of more than one form: 2d, 3d"):
        collide.arrow.resolve(pa.table(SPACE), columns=plane)
    expected = collide.resolve_2d(**{name: SPACE[plane.get(name, name)] for name in PLANE})
    assert_resolved(collide.arrow.resolve(pa.table(SPACE), "2d", plane), SPACE, expected)


def test_nulls_and_types_and_doubles_are_refused():
    null = pa.array([*LINE["v2"][:700], None, *LINE["v2"][701:]])
    table = pa.concat_tables([pa.table({**LINE, "v2": null}).slice(k, 250) for k in range(0, N, 250)])
    with pytest.raises(ValueError, match="column v2: row 700: is null"):
        collide.arrow.resolve(table)
    for column in (pa.array(["x"] * N), pa.array([[1]] * N), pa.array([0] * N, pa.timestamp("s")), pa.nulls(N)):
        with pytest.raises(TypeError, match=r"column m2: has type .*, must be a real number"):
            collide.arrow.resolve(pa.table({**LINE, "m2": column}))
    double = pa.table([*LINE.values(), LINE["m1"]], names=[*LINE, "m1"])
    with pytest.raises(ValueError, match="column m1: there are 2 of that name"):
        collide.arrow.resolve(double)


# Who else takes Arrow


def test_polars():
    frame = pl.DataFrame(PLANE)
    resolved = pl.from_arrow(collide.arrow.resolve(frame.to_arrow()))
    np.testing.assert_array_equal(resolved["u2y"].to_numpy(), collide.resolve_2d(**PLANE).u2y)
    # Lazily, batch by batch, as far as Polars streams.
    schema = {**frame.schema, **dict.fromkeys(("u1x", "u1y", "u2x", "u2y"), pl.Float64)}
    lazy = frame.lazy().map_batches(
        lambda part: pl.from_arrow(collide.arrow.resolve(part.to_arrow())), schema=schema, streamable=True
    )
    assert lazy.select("u1x").collect(engine="streaming").equals(resolved.select("u1x"))


def test_duckdb():
    with duckdb.connect() as connection:
        connection.register("pairs", pa.table(PLANE))
        reader = pa.RecordBatchReader.from_stream(connection.sql("select * from pairs where m1 > 1"))
        resolved = pa.Table.from_batches(collide.arrow.resolve(batch) for batch in reader)
        connection.register("resolved", resolved)
        (count,) = connection.execute("select count(*) from resolved where u1x is not null").fetchone()
    heavy = PLANE["m1"] > 1
    assert count == heavy.sum()
    expected = collide.resolve_2d(**{name: column[heavy] for name, column in PLANE.items()})
    np.testing.assert_array_equal(resolved["u1x"], expected.u1x)


def through_arrow(part):
    return collide.arrow.resolve(pa.Table.from_pandas(part)).to_pandas()


def test_dask_dataframe():
    frame = pd.DataFrame(PLANE)
    resolved = dd.from_pandas(frame, npartitions=3).map_partitions(through_arrow).compute(scheduler="threads")
    np.testing.assert_array_equal(resolved["u1y"], collide.resolve_2d(**PLANE).u1y)
    assert resolved.index.equals(frame.index)


# What holds arrays: taken as one


@pytest.mark.parametrize("kind", [pd.Series, pl.Series, xr.DataArray, pa.array])
def test_series_and_the_like_are_arrays(kind):
    u = collide.resolve_1d(*(kind(column) for column in LINE.values()))
    np.testing.assert_array_equal(u.u1, collide.resolve_1d(**LINE).u1, strict=True)

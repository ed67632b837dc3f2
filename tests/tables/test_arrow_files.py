"""Parquet and Arrow files: types, encodings and metadata stay, and damage is named with column and row."""

import re
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.csv
import pyarrow.parquet as pq
import pytest

from collide._tables import by_name, ipc_files, parquet_files
from tests.helpers import process
from tests.helpers.tables import (
    FOREIGN,
    LINE,
    N,
    assert_one_line,
    assert_refused,
    read,
    resolve,
    write,
)

pytestmark = pytest.mark.usefixtures("small_blocks")


@pytest.mark.parametrize("suffix", [".parquet", ".arrow", ".arrows"])
def test_foreign_columns_and_metadata_pass_through_arrow_unchanged(suffix, tmp_path):
    table = pa.table({**FOREIGN, **LINE}).replace_schema_metadata({"from": "here"})
    source, target = tmp_path / f"a{suffix}", tmp_path / f"b{suffix}"
    write(source, table)
    assert resolve(source, target) == 0
    before, after = read(source), read(target)
    assert after.select(before.column_names).equals(before, check_metadata=True)
    after.validate(full=True)


@pytest.mark.parametrize("dictionary", [True, False])
def test_long_rows_make_short_blocks(dictionary, tmp_path):
    """Also where they are stored once for all, and where those before them are short."""
    table = pa.table({**LINE, "long": pa.array(["x" * 5000] * N)})
    short = pa.table({**LINE, "long": pa.array([""] * N)})
    for suffix, kind in ((".parquet", parquet_files.Parquet), (".arrow", ipc_files.Ipc)):
        options = {"use_dictionary": dictionary, "row_group_size": N} if suffix == ".parquet" else {}
        source = write(tmp_path / f"a{suffix}", pa.concat_tables([short, short, table]), **options)
        opened = kind(source)
        opened.select(by_name.choose(table.column_names, None, None, by_name.options(None, False, "raise")))
        assert next(block.n_rows for block in opened.blocks() if block.start >= 2 * N) <= 8


@pytest.mark.parametrize("suffix", [".parquet", ".arrow", ".arrows"])
def test_nothing_imports_pandas(suffix, tmp_path):
    """Much of pyarrow does where it is installed; a small file would wait for it longer than for all else but Numba."""
    source = write(tmp_path / f"a{suffix}", {**LINE, "m2": LINE["m1"] > 1.0})
    code = "import sys; from collide.__main__ import main; print(main(sys.argv[1:]), 'pandas' in sys.modules)"
    said = process.printed_by(code, "resolve", source, "-o", tmp_path / f"b{suffix}", "--quiet")
    assert said == "0 False\n"


# Data at fault


@pytest.mark.parametrize("suffix", [".parquet", ".arrow", ".arrows"])
def test_a_null_is_named_with_its_row(suffix, tmp_path, capsys):
    v2 = pa.array(np.where(np.arange(N) >= 777, np.nan, LINE["v2"]), from_pandas=True)
    source, target = tmp_path / f"a{suffix}", tmp_path / "b" / f"b{suffix}"
    target.parent.mkdir()
    write(source, pa.table({**LINE, "v2": v2}))
    assert resolve(source, target) == 1
    assert_refused(capsys, target, source, "column v2: row 777: is null")


def test_one_is_no_plural(tmp_path, capsys):
    table = pa.table({"m1": [1.0, np.inf], "m2": [1.0, 1.0], "v1": [None, 3.0], "v2": [0.0, 0.0]})
    write(tmp_path / "a.parquet", table)
    assert resolve(tmp_path / "a.parquet", tmp_path / "b.parquet") == 1
    assert_one_line(capsys, "column v1: row 0: is null (1 null from here on)")
    write(tmp_path / "c.parquet", table.slice(1))
    assert resolve(tmp_path / "c.parquet", tmp_path / "d.parquet") == 0
    said = capsys.readouterr().out
    assert said.startswith("1 pair, 0 of them invalid; ")
    assert said.endswith(" (1 pair, invalid or without a finite energy, not counted)\n")
    write(tmp_path / "e", {**LINE, "v1": np.ones(1)})
    assert resolve(tmp_path / "e", tmp_path / "f") == 1
    assert_one_line(capsys, "column v1: has 1 row where m1 has 1,000; they part at row 1")


@pytest.mark.parametrize("suffix", [".parquet", ".arrow", ".arrows"])
@pytest.mark.parametrize("column", ["name", "tags", "kind", "when", "nested", "price"])
def test_a_column_of_the_wrong_type(suffix, column, tmp_path, capsys):
    source, target = tmp_path / f"a{suffix}", tmp_path / "b" / f"b{suffix}"
    target.parent.mkdir()
    write(source, pa.table({**LINE, "m2": FOREIGN[column]}))
    assert resolve(source, target) == 1
    assert_refused(capsys, target, source, "column m2: has type ", "must be a real number")


def damage(path, place, length=40):
    content = bytearray(path.read_bytes())
    content[place : place + length] = b"\xa5" * length
    path.write_bytes(content)


def test_an_unreadable_row_group_is_named_with_column_and_row(tmp_path, capsys):
    source, target = tmp_path / "a.parquet", tmp_path / "b" / "b.parquet"
    target.parent.mkdir()
    write(source, LINE, compression="zstd", use_dictionary=False)
    column = pq.ParquetFile(source).metadata.row_group(1).column(2)
    damage(source, column.data_page_offset + 60)
    assert resolve(source, target) == 1
    assert_refused(capsys, target, source, "column v1: row 400: cannot be read")


def test_an_unreadable_batch_is_named_with_column_and_row(tmp_path, capsys):
    source, target = tmp_path / "a.arrow", tmp_path / "b" / "b.arrow"
    target.parent.mkdir()
    table = pa.table(LINE)
    with pa.ipc.new_file(source, table.schema, options=pa.ipc.IpcWriteOptions(compression="zstd")) as writer:
        writer.write_table(table, 400)
    frames = [m.start() for m in re.finditer(re.escape(b"\x28\xb5\x2f\xfd"), source.read_bytes())]
    assert len(frames) == 12  # of zstd: four columns in three batches
    damage(source, frames[5] + 20)
    assert resolve(source, target) == 1
    assert_refused(capsys, target, source, "column m2: row 400: cannot be read")


@pytest.mark.parametrize("suffix", [".parquet", ".arrow", ".csv"])
def test_names_that_pyarrow_could_take_for_something_else(suffix, tmp_path, monkeypatch, capfd):
    monkeypatch.chdir(tmp_path)
    write(tmp_path / f"s3:a{suffix}", LINE)
    assert resolve(Path(f"s3:a{suffix}"), Path(f"file:b{suffix}")) == 0
    assert (tmp_path / f"file:b{suffix}").exists()
    assert capfd.readouterr().err == ""


def test_an_arrow_file_is_no_stream(tmp_path, capsys):
    source = write(tmp_path / "a.arrows", LINE).rename(tmp_path / "a.arrow")
    assert resolve(source, tmp_path / "b.arrow") == 1
    assert_one_line(capsys, source, "is no .arrow file; it begins as a .arrows file does: --from arrows")


def test_views_are_written_with_their_own_data_only(tmp_path):
    text = pa.array([f"a text that is too long to stand in a view {k}" for k in range(N)], pa.string_view())
    table = pa.table({**LINE, "text": text, "bytes": text.cast(pa.binary_view())})
    source, target = write(tmp_path / "a.arrow", table), tmp_path / "b.arrow"
    assert resolve(source, target) == 0
    assert read(target).select(table.column_names).equals(table)
    assert target.stat().st_size < 2 * source.stat().st_size


@pytest.mark.parametrize("suffix", [".arrow", ".arrows"])
def test_dictionaries_that_grow_from_batch_to_batch(suffix, tmp_path):
    words = ["x", "y", None, "z"] * (N // 8), ["x", "y", "z", "more"] * (N // 8)
    table = pa.table({**LINE, "text": pa.chunked_array([pa.array(part).dictionary_encode() for part in words])})
    options = pa.ipc.IpcWriteOptions(emit_dictionary_deltas=True)
    source, target = write(tmp_path / f"a{suffix}", table, options=options), tmp_path / f"b{suffix}"
    assert resolve(source, target) == 0
    assert read(target).select(table.column_names).equals(read(source))


def test_unions_and_damage_in_arrow(tmp_path, capsys):
    union = pa.UnionArray.from_sparse(pa.array([0, 1] * (N // 2), pa.int8()), [pa.array(range(N)), pa.array(["x"] * N)])
    source = write(tmp_path / "a.arrow", pa.table({**LINE, "union": union}))
    assert resolve(source, tmp_path / "b.arrow") == 0
    text = pa.table({**LINE, "text": [f"{k}" for k in range(N)]})
    content = write(tmp_path / "c.arrow", text).read_bytes()
    place = content.index(text["text"].chunk(0).buffers()[1].to_pybytes()[:400])
    for row in (0, 301, N):  # an offset at the end of a batch, of a block, or in its midst
        damaged = bytearray(content)
        damaged[place + 4 * row : place + 4 * row + 4] = (-5).to_bytes(4, "little", signed=True)
        (tmp_path / "c.arrow").write_bytes(damaged)
        capsys.readouterr()
        status = resolve(tmp_path / "c.arrow", tmp_path / "d.arrow", "--overwrite")
        said = capsys.readouterr().err
        assert status in (0, 1)
        assert len(said.splitlines()) == status, said


def test_a_name_that_is_given_is_meant(tmp_path, capsys):
    source = write(tmp_path / "a.arrow", LINE)
    assert resolve(source, tmp_path / "b.arrow", "--columns", "v1x=v1") == 1
    assert "missing column" in capsys.readouterr().err

"""Files of any size: what `collide resolve` writes, and what it says of bad ones."""

import fcntl
import importlib.util
import os
import pty
import re
import shutil
import struct
import sys
import termios
import threading
import time
import warnings
import zipfile
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.csv
import pyarrow.parquet as pq
import pytest

import collide
from collide._tables import arrow_files, by_name, ipc_files, stream
from tests.helpers import process
from tests.helpers.tables import (
    FORMATS,
    FORMS,
    LINE,
    PLANE,
    POLAR,
    RNG,
    N,
    assert_one_line,
    assert_refused,
    make_small_blocks,
    read,
    resolve,
    write,
)


@pytest.fixture(autouse=True)
def _small_blocks(monkeypatch):
    make_small_blocks(monkeypatch)


@pytest.fixture(params=FORMATS, ids=lambda suffix: suffix or "folder")
def paths(request, tmp_path):
    (tmp_path / "out").mkdir()
    return tmp_path / f"pairs{request.param}", tmp_path / "out" / f"after{request.param}"


# What is written


@pytest.mark.parametrize("form", FORMS)
def test_output_is_the_input_and_the_batch_result(form, paths, capsys):
    columns, function = FORMS[form]
    write(paths[0], columns)
    assert resolve(*paths) == 0
    captured = capsys.readouterr()
    assert captured.err == ""
    assert captured.out.startswith("1,000 pairs, 0 of them invalid; relative change of total momentum ")
    changes = re.findall(r"(?:momentum|energy) (\S+?)[,\n]", captured.out)
    assert len(changes) == 2
    assert all(abs(float(change)) < 1e-15 for change in changes)
    written, expected = read(paths[1]), {**columns, **function(**columns)._asdict()}
    assert set(expected) == set(written if isinstance(written, dict) else written.column_names)
    if paths[0].suffix:
        assert written.column_names == list(expected)
    for name, column in expected.items():
        np.testing.assert_array_equal(np.asarray(written[name]), column, strict=True)
    assert list(paths[1].parent.iterdir()) == [paths[1]]


FOREIGN = {
    "name": pa.array(["red", "grün", "", "a,b", 'say "so"', "two\nlines", "007", " x ", None, "1.50"] * (N // 10)),
    "tags": pa.array([[1, 2], None, [], [3], [4, 5]] * (N // 5)),
    "kind": pa.array(["x", "y"] * (N // 2)).dictionary_encode(),
    "when": pa.array([0, None] * (N // 2), pa.timestamp("us", tz="UTC")),
    "nested": pa.array([{"a": 1, "b": None}, {"a": 2, "b": "c"}] * (N // 2)),
    "price": pa.array([None, "1.25"] * (N // 2), pa.string()).cast(pa.decimal128(9, 2)),
}


@pytest.mark.parametrize("suffix", [".parquet", ".arrow", ".arrows"])
def test_foreign_columns_and_metadata_pass_through_arrow_unchanged(suffix, tmp_path):
    table = pa.table({**FOREIGN, **LINE}).replace_schema_metadata({"from": "here"})
    source, target = tmp_path / f"a{suffix}", tmp_path / f"b{suffix}"
    write(source, table)
    assert resolve(source, target) == 0
    before, after = read(source), read(target)
    assert after.select(before.column_names).equals(before, check_metadata=True)
    after.validate(full=True)


def test_foreign_files_pass_through_a_folder_unread(tmp_path):
    source = write(tmp_path / "a", LINE)
    np.save(source / "other.npy", np.arange(6.0).reshape(2, 3))
    np.save(source / "object.npy", np.array([{"a": 1}], object))
    (source / "damaged.npy").write_bytes(b"what")
    (source / "notes.txt").write_text("not a column")
    assert resolve(source, tmp_path / "b") == 0
    for name in ("other", "object", "damaged", *LINE):
        assert (tmp_path / "b" / f"{name}.npy").read_bytes() == (source / f"{name}.npy").read_bytes()
    assert {file.suffix for file in (tmp_path / "b").iterdir()} == {".npy"}


@pytest.mark.parametrize("dtype", ["f4", "f2", "i2", "u8", "?", ">f8"])
def test_columns_of_a_folder_keep_their_dtype(dtype, tmp_path):
    columns = {**LINE, "m1": np.ones(N, dtype), "m2": np.array(2.0)}
    source = write(tmp_path / "a", columns)
    assert resolve(source, tmp_path / "b") == 0
    written = read(tmp_path / "b")
    for name, column in {**columns, **collide.resolve_1d(**columns)._asdict()}.items():
        np.testing.assert_array_equal(written[name], column, strict=True)


@pytest.mark.parametrize("suffix", [".parquet", ".arrow", ".arrows", ""])
def test_float32_columns(suffix, tmp_path):
    columns = {name: column.astype(np.float32) for name, column in PLANE.items()}
    write(tmp_path / f"a{suffix}", columns)
    assert resolve(tmp_path / f"a{suffix}", tmp_path / f"b{suffix}") == 0
    for name, u in collide.resolve_2d(**columns)._asdict().items():
        np.testing.assert_array_equal(np.asarray(read(tmp_path / f"b{suffix}")[name]), u, strict=True)


def test_a_folder_of_single_numbers(tmp_path):
    write(tmp_path / "a", {name: column[0] for name, column in LINE.items()})
    assert resolve(tmp_path / "a", tmp_path / "b") == 0
    np.testing.assert_array_equal(
        np.load(tmp_path / "b" / "u1.npy"), collide.resolve_1d(*(c[0] for c in LINE.values()))[0]
    )


def test_no_rows(paths, capsys):
    write(paths[0], {name: column[:0] for name, column in LINE.items()})
    assert resolve(*paths) == 0
    assert capsys.readouterr().out.startswith("0 pairs, ")
    written = read(paths[1])
    assert len(written["u2"]) == 0
    assert len(written) == 6 or len(written.column_names) == 6


TEXT = b"""id,m1,m2,"v,1",v2,note\r
007,1.50, 2,3.0e0,-1,plain\r
8,"1",2.,inf,0,"with, comma"\n"9",1,2,5,.5,"say ""so""\nin two lines"
"""


def test_csv_stays_as_it_is(tmp_path):
    (tmp_path / "a.csv").write_bytes(TEXT.replace(b"inf", b"7"))
    assert resolve(tmp_path / "a.csv", tmp_path / "b.csv", "--columns", "v1=v,1") == 2  # a comma parts names
    (tmp_path / "a.csv").write_bytes(TEXT.replace(b"inf", b"7").replace(b'"v,1"', b"v1"))
    assert resolve(tmp_path / "a.csv", tmp_path / "b.csv") == 0
    u1, u2 = collide.resolve_1d([1.5, 1.0, 1.0], 2.0, [3.0, 7.0, 5.0], [-1.0, 0.0, 0.5])
    u = [f"{a!r},{b!r}".replace(".0,", ",").removesuffix(".0") for a, b in zip(u1.tolist(), u2.tolist(), strict=True)]
    assert (tmp_path / "b.csv").read_text() == (
        "id,m1,m2,v1,v2,note,u1,u2\n"
        f"007,1.50, 2,3.0e0,-1,plain,{u[0]}\n"
        f'8,1,2.,7,0,"with, comma",{u[1]}\n'
        f'9,1,2,5,.5,"say ""so""\nin two lines",{u[2]}\n'
    )


def test_csv_of_foreign_text_and_many_blocks(tmp_path):
    table = pa.table({**LINE, "name": FOREIGN["name"].fill_null("")})
    write(tmp_path / "a.csv", table)
    assert resolve(tmp_path / "a.csv", tmp_path / "b.csv") == 0
    options = pa.csv.ParseOptions(newlines_in_values=True)
    as_text = pa.csv.ConvertOptions(column_types={"name": pa.string()})
    after = pa.csv.read_csv(tmp_path / "b.csv", parse_options=options, convert_options=as_text)
    assert after["name"].to_pylist() == table["name"].to_pylist()
    np.testing.assert_array_equal(after["u2"], collide.resolve_1d(**LINE).u2)


def test_parquet_keeps_compression_and_encodings(tmp_path):
    table = pa.table({**LINE, "name": FOREIGN["name"], "tags": FOREIGN["tags"]})
    codecs = {"m1": "zstd", "m2": "snappy", "v1": "none", "v2": "gzip", "name": "lz4", "tags.list.element": "zstd"}
    write(tmp_path / "a.parquet", table, compression=codecs, use_dictionary=["name"])
    assert resolve(tmp_path / "a.parquet", tmp_path / "b.parquet") == 0
    before, after = (pq.ParquetFile(tmp_path / f"{name}.parquet").metadata.row_group(0) for name in "ab")
    for c in range(before.num_columns):
        assert before.column(c).compression == after.column(c).compression
        assert ("PLAIN" in before.column(c).encodings) == ("PLAIN" in after.column(c).encodings)
        assert before.column(c).has_dictionary_page == after.column(c).has_dictionary_page
    assert after.column(before.num_columns).compression == "ZSTD"  # as m1
    assert not after.column(before.num_columns).has_dictionary_page


@pytest.mark.parametrize("dictionary", [True, False])
def test_long_rows_make_short_blocks(dictionary, tmp_path):
    """Also where they are stored once for all, and where those before them are short."""
    table = pa.table({**LINE, "long": pa.array(["x" * 5000] * N)})
    short = pa.table({**LINE, "long": pa.array([""] * N)})
    for suffix, kind in ((".parquet", arrow_files.Parquet), (".arrow", ipc_files.Ipc)):
        options = {"use_dictionary": dictionary, "row_group_size": N} if suffix == ".parquet" else {}
        source = write(tmp_path / f"a{suffix}", pa.concat_tables([short, short, table]), **options)
        opened = kind(source)
        opened.select(by_name.choose(table.column_names, None, None, by_name.options(None, False, "raise")))
        assert next(block.n_rows for block in opened.blocks() if block.start >= 2 * N) <= 8


# Names and options


def test_names_are_mapped(paths):
    called = {"m1": "mass a", "v1x": "speed"}
    write(paths[0], {called.get(name, name): column for name, column in PLANE.items()})
    names = ",".join(f"{name}={column}" for name, column in {**called, "u1x": "after"}.items())
    assert resolve(*paths, "--columns", names) == 0
    written, u = read(paths[1]), collide.resolve_2d(**PLANE)
    np.testing.assert_array_equal(np.asarray(written["after"]), u.u1x)
    np.testing.assert_array_equal(np.asarray(written["u1y"]), u.u1y)


def test_form_decides_where_columns_would_do_for_several(paths, capsys):
    write(paths[0], {**POLAR, **PLANE})
    assert resolve(*paths) == 1
    assert_refused(capsys, paths[1], paths[0], "more than one form", "2d, polar")
    assert resolve(*paths, "--form", "1d") == 0
    columns = {name: {**POLAR, **PLANE}[name] for name in LINE}
    np.testing.assert_array_equal(np.asarray(read(paths[1])["u1"]), collide.resolve_1d(**columns).u1)


def test_restitution_as_a_column_and_as_a_number(paths):
    e = RNG.uniform(0.0, 1.0, N)
    write(paths[0], {**LINE, "restitution": e})
    assert resolve(*paths) == 0
    np.testing.assert_array_equal(np.asarray(read(paths[1])["u1"]), collide.resolve_1d(**LINE, restitution=e).u1)
    assert resolve(*paths, "--restitution", "0.5", "--approaching-only", "--overwrite") == 0
    expected = collide.resolve_1d(**LINE, restitution=0.5, approaching_only=True)
    np.testing.assert_array_equal(np.asarray(read(paths[1])["u1"]), expected.u1)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--columns", "m1"], ["NAME=COLUMN"]),
        (["--columns", "m1=a,m1=b"], ["NAME=COLUMN"]),
        (["--columns", "mass=a"], ["'mass'", "m1"]),
        (["--form", "cartesian"], ["cartesian", "2d"]),
        (["--restitution", "much"], ["much"]),
        (["--restitution", "-1"], ["restitution = -1.0"]),
        (["--restitution", "nan"], ["restitution = nan"]),
    ],
    ids=lambda value: " ".join(value),
)
def test_wrong_options(options, words, tmp_path, capsys):
    source, target = write(tmp_path / "a.parquet", LINE), tmp_path / "b.parquet"
    assert resolve(source, target, *options) == 2
    said = capsys.readouterr().err
    assert all(word in said for word in words), said
    assert said.splitlines()[-1].startswith("collide")
    assert list(tmp_path.iterdir()) == [source]


def test_quiet_says_nothing(paths, capsys):
    write(paths[0], LINE)
    assert resolve(*paths, "--quiet") == 0
    assert capsys.readouterr() == ("", "")


def on_a_terminal(source, target, *options):
    """What the command shows on a terminal of 100 columns."""
    ours, theirs = pty.openpty()
    fcntl.ioctl(theirs, termios.TIOCSWINSZ, struct.pack("4H", 24, 100, 0, 0))
    command = sys.executable, "-m", "collide", "resolve", source, "-o", target, *options
    with process.running(*command, stdout=theirs, stderr=theirs) as showing:
        os.close(theirs)
        shown = b""
        while True:
            try:
                part = os.read(ours, 1 << 16)
            except OSError:  # Linux's way to say that all is read
                break
            shown += part
        os.close(ours)
        assert showing.wait(timeout=60) == 0
    return shown.decode()


def test_progress_on_a_terminal(paths):
    write(paths[0], LINE)
    shown = on_a_terminal(*paths)
    assert re.search(r"100%.*1\.00k/1\.00k \[.*rows/s\]", shown) or paths[0].suffix == ".arrows"
    assert re.search(r"1\.00k.* rows", shown)
    shutil.rmtree(paths[1]) if paths[1].is_dir() else paths[1].unlink()
    # Where colorama is installed, Numba leaves the terminal's colours reset.
    assert on_a_terminal(*paths, "--quiet").removesuffix("\x1b[0m") == ""


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
    assert said.endswith(" (1 pair without a finite energy not counted)\n")
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


@pytest.mark.parametrize(
    ("value", "words"), [("fast", "'fast' is no number"), ("", "there is no number"), ("1;5", "'1;5'")]
)
def test_what_is_no_number_in_csv(value, words, tmp_path, capsys):
    v1 = [*map(repr, LINE["v1"].tolist())]
    v1[901] = value
    source, target = write(tmp_path / "a.csv", {**LINE, "v1": v1}), tmp_path / "b" / "b.csv"
    target.parent.mkdir()
    assert resolve(source, target) == 1
    assert_refused(capsys, target, source, f"column v1: row 901: {words}")


@pytest.mark.parametrize("column", [*LINE, "restitution"])
@pytest.mark.parametrize("rule", ["raise", "keep", "nan"])
@pytest.mark.parametrize("value", ["1e400", "-1e400", "1.7976931348623159e308", " +2e308 ", "1" + "0" * 400])
def test_a_number_that_csv_cannot_mean(value, rule, column, tmp_path, capsys):
    """It would be read as inf, and as a mass be a wall."""
    values = [*map(repr, LINE["v1"].tolist())]
    values[7] = values[701] = "inf"
    values[901] = values[902] = value
    columns = {**LINE, "restitution": LINE["v1"], column: values}
    source, target = write(tmp_path / "a.csv", columns), tmp_path / "b" / "b.csv"
    target.parent.mkdir()
    rule = rule if column in ("m1", "m2") else "keep"  # anywhere else, inf is an error of its own before
    assert resolve(source, target, "--invalid", rule) == 1
    assert_refused(capsys, target, source, f"column {column}: row 901: ", "is beyond the largest number, 1.8e308")


@pytest.mark.parametrize("value", ["inf", "INF", "+inf", "Infinity", "  inf", "infinity "])
def test_walls_in_csv_are_written_as_such(value, tmp_path):
    (tmp_path / "a.csv").write_text(f"m1,m2,v1,v2\n1,{value},3,0\n1,1,1e-400,8e307\n")
    assert resolve(tmp_path / "a.csv", tmp_path / "b.csv") == 0
    assert read(tmp_path / "b.csv")["u1"].to_pylist() == [-3.0, 8e307]


@pytest.mark.parametrize("value", ["nan", "-NaN", "nan(1)"])
def test_no_number_in_csv_is_an_invalid_pair(value, tmp_path, capsys):
    (tmp_path / "a.csv").write_text(f"m1,m2,v1,v2\n1,{value},3,0\n")
    assert resolve(tmp_path / "a.csv", tmp_path / "b.csv") == 1
    assert_one_line(capsys, "row 0: m2 = nan: a mass must be")


@pytest.mark.parametrize("value", ["0x10", "1_000", "1e", "1d5", "1f", "--1", "\u0661", "True", "infinite", "1 2"])
def test_what_only_some_languages_take_for_a_number(value, tmp_path, capsys):
    (tmp_path / "a.csv").write_text(f"m1,m2,v1,v2\n1,1,3,{value}\n")
    assert resolve(tmp_path / "a.csv", tmp_path / "b.csv") == 1
    assert_one_line(capsys, "column v2: row 0: ", "is no number")


@pytest.mark.parametrize("end", ["", "\n", "\r\n", "\r"])
@pytest.mark.parametrize("names", ["m1,m2,v1,v2", '"m1",m2,v1,"v2"', '\ufeffm1,m2,v1,v2,"a\nb"'])
def test_csv_of_names_alone(names, end, tmp_path, capsys):
    (tmp_path / "a.csv").write_text(names + end, newline="")
    assert resolve(tmp_path / "a.csv", tmp_path / "b.csv") == 0
    captured = capsys.readouterr()
    assert captured.err == ""
    assert captured.out.startswith("0 pairs, ")
    written = names.replace('"m1"', "m1").replace('"v2"', "v2").removeprefix("\ufeff")
    assert (tmp_path / "b.csv").read_text() == written + ",u1,u2\n"


@pytest.mark.parametrize("end", ["", "\n", "\r\n", "\r"])
def test_csv_whose_last_line_does_not_end(end, tmp_path):
    for n in (1, 3000):  # less and more than what is read at once
        (tmp_path / "a.csv").write_text("m1,m2,v1,v2" + "\n1,1,3.5,0" * n + end, newline="")
        assert resolve(tmp_path / "a.csv", tmp_path / "b.csv", "--overwrite") == 0
        assert read(tmp_path / "b.csv")["u2"].to_pylist() == [3.5] * n


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (b"", ["Empty CSV file"]),
        (b"m1,m2,v1,v2\n1,2,3,4\n1,2,3\n", ["Row #3", "Expected 4 columns, got 3"]),
        (b"m1,m2,v1,v2\n1,2,3,4\n\xff,2,3,4\n", ["UTF8"]),
        (b"m1,m2,v1,m1\n1,2,3,4\n", ["missing column v2"]),
        (b"m1,m2,v1,v2,m1\n1,2,3,4,5\n", ["column m1: there are 2 of that name"]),
        (b"\x00\x01\x02", ["missing column m1"]),
        (b"m1,m2,v1", ["missing column v2"]),
    ],
)
def test_csv_that_is_none(text, words, tmp_path, capsys):
    source, target = tmp_path / "a.csv", tmp_path / "b" / "b.csv"
    target.parent.mkdir()
    source.write_bytes(text)
    assert resolve(source, target) == 1
    assert_refused(capsys, target, source, *words)


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


@pytest.mark.parametrize("part", [0.0, 0.01, 0.5, 0.99])
def test_a_truncated_file(part, paths, capsys):
    write(paths[0], LINE)
    file = paths[0] / "v1.npy" if paths[0].is_dir() else paths[0]
    file.write_bytes(file.read_bytes()[: int(part * file.stat().st_size)])
    cut_between_rows = paths[0].suffix == ".csv" and part > 0.01
    status = resolve(*paths)
    if cut_between_rows and status == 0:  # the last number may be cut to a number
        assert len(read(paths[1])["u2"]) == len(read(paths[0])["v2"]) < N
        return
    assert status == 1
    assert_refused(capsys, paths[1], paths[0])


def test_an_invalid_pair_is_named_with_its_row_in_the_file(paths, capsys):
    write(paths[0], {**LINE, "m2": np.where(np.arange(N) == 642, -1.0, LINE["m2"])})
    assert resolve(*paths) == 1
    assert_refused(capsys, paths[1], paths[0], "row 642: m2 = -1.0: a mass must be")


@pytest.mark.parametrize("rule", ["keep", "nan"])
def test_invalid_pairs_are_written_and_counted_on_request(rule, paths, capsys):
    columns = {**LINE, "m2": np.where(np.arange(N) % 400 == 399, -1.0, LINE["m2"])}
    write(paths[0], columns)
    assert resolve(*paths, "--invalid", rule) == 0
    assert capsys.readouterr().out.startswith("1,000 pairs, 2 of them invalid; ")
    for name, u in collide.resolve_1d(**columns, invalid=rule)._asdict().items():
        np.testing.assert_array_equal(np.asarray(read(paths[1])[name]).astype(float), u)


def test_walls_are_left_out_of_the_report(tmp_path, capsys):
    source = write(tmp_path / "a.arrow", {**LINE, "m2": np.where(np.arange(N) < 10, np.inf, LINE["m2"])})
    assert resolve(source, tmp_path / "b.arrow") == 0
    assert capsys.readouterr().out.endswith(" (10 pairs without a finite energy not counted)\n")


# What becomes of the output


@pytest.mark.parametrize("name", ["../evil", "a/b", "/tmp/evil"])
def test_a_column_is_not_written_elsewhere(name, tmp_path, capsys):
    source = write(tmp_path / "a", LINE)
    (tmp_path / "out").mkdir()
    target = tmp_path / "out" / "b"
    assert resolve(source, target, "--columns", f"u1={name}") == 1
    assert_refused(capsys, target, f"column {name}: cannot be the name of a file")


@pytest.mark.parametrize(("one", "other"), [(".parquet", ".csv"), (".csv", ".npz"), (".arrow", ".txt"), (".npz", "")])
def test_the_output_has_the_format_of_the_input(one, other, tmp_path, capsys):
    source = tmp_path / f"a{one}"
    np.savez(source, **LINE) if one == ".npz" else write(source, LINE)
    assert resolve(source, tmp_path / f"b{other}") == 2
    assert f"must have the format of the input, {one}" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == [source]


def test_an_input_of_no_known_format(tmp_path, capsys):
    (tmp_path / "a.xls").write_text("m1")
    assert resolve(tmp_path / "a.xls", tmp_path / "b.xls") == 2
    assert "a folder of .npy files, or one of .npz, .parquet" in capsys.readouterr().err


def test_without_pyarrow_it_is_said(tmp_path):
    source = write(tmp_path / "a.parquet", LINE)
    code = "import sys; sys.modules['pyarrow'] = None; from collide.__main__ import main; sys.exit(main(sys.argv[1:]))"
    done = process.python(code, "resolve", source, "-o", tmp_path / "b.parquet")
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr == f"collide: {source}: needs pyarrow: pip install pyarrow\n"


def test_without_tqdm_it_works(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True, raising=False)
    source = write(tmp_path / "a", LINE)
    assert resolve(source, tmp_path / "b") == 0
    assert set(read(tmp_path / "b")) == {*LINE, "u1", "u2"}
    assert capsys.readouterr().err == ""


# What attacks found


def test_energies_beyond_float64_do_not_stop_the_report(tmp_path, capsys):
    v = 1e153 * RNG.uniform(0.5, 1.0, N)
    source = write(tmp_path / "a", {"m1": np.ones(N), "m2": np.ones(N), "v1": v, "v2": -v})
    assert resolve(source, tmp_path / "b") == 0
    assert "(1,000 pairs without a finite energy not counted)" in capsys.readouterr().out


def test_a_folder_with_an_archive_for_a_column(tmp_path, capsys):
    source = write(tmp_path / "a", LINE)
    np.savez(tmp_path / "m1.npz", **LINE)
    (tmp_path / "m1.npz").replace(source / "m1.npy")
    assert resolve(source, tmp_path / "b") == 1
    assert "column m1: is no .npy file" in capsys.readouterr().err


def test_a_folder_with_a_dangling_link(tmp_path, capsys):
    source = write(tmp_path / "a", LINE)
    (source / "x.npy").symlink_to(tmp_path / "nowhere")
    assert resolve(source, tmp_path / "b") == 1
    assert "column x: is not a file" in capsys.readouterr().err


def test_two_members_of_one_name(tmp_path, capsys):
    source = tmp_path / "a.npz"
    np.savez(source, **LINE)
    with warnings.catch_warnings(), zipfile.ZipFile(source, "a") as archive:
        warnings.simplefilter("ignore")
        archive.writestr("m1.npy", archive.read("m1.npy"))
    assert resolve(source, tmp_path / "b.npz") == 1
    assert (
        "column m1: cannot be read as a .npz file of plain arrays (there are two of that name)"
        in capsys.readouterr().err
    )


@pytest.mark.parametrize("suffix", [".parquet", ".arrow", ".csv"])
def test_names_that_pyarrow_could_take_for_something_else(suffix, tmp_path, monkeypatch, capfd):
    monkeypatch.chdir(tmp_path)
    write(tmp_path / f"s3:a{suffix}", LINE)
    assert resolve(Path(f"s3:a{suffix}"), Path(f"file:b{suffix}")) == 0
    assert (tmp_path / f"file:b{suffix}").exists()
    assert capfd.readouterr().err == ""


ODD = os.fsdecode(b"caf\xe9")  # in Latin-1, which is not UTF-8


@pytest.mark.parametrize("suffix", [*FORMATS, ".npz"])
def test_names_of_files_that_are_not_utf8(suffix, tmp_path, capsys):
    """They work; in messages, what is no text is shown as the shell takes it."""
    source, target = tmp_path / (ODD + suffix), tmp_path / (ODD + "-after" + suffix)
    np.savez(source, **LINE) if suffix == ".npz" else write(tmp_path / f"a{suffix}", LINE).rename(source)
    assert resolve(source, target, "--quiet") == 0
    assert target.exists()
    assert resolve(source, target) == 2
    assert (
        capsys.readouterr().err
        == f"collide: {tmp_path}/caf\\xe9-after{suffix}: is there already; --overwrite replaces it\n"
    )
    assert resolve(source, target, "--columns", "m2=mass", "--overwrite") == 1
    assert_one_line(capsys, f"{tmp_path}/caf\\xe9{suffix}: missing column mass")


@pytest.mark.parametrize("suffix", [".parquet", ".arrow", ".arrows", ".csv", ".npz"])
@pytest.mark.parametrize(
    "content", [b"", b"what?", bytes(100), b"ARROW1" * 3, b"PAR1" * 3, b"PK\x03\x04", b"\xff" * 40]
)
def test_damage_in_files_whose_names_are_not_utf8(content, suffix, tmp_path, capsys):
    source, target = tmp_path / (ODD + suffix), tmp_path / "out" / f"b{suffix}"
    target.parent.mkdir()
    source.write_bytes(content)
    assert resolve(source, target) == 1
    assert_refused(capsys, target, f"{tmp_path}/caf\\xe9{suffix}: ")


@pytest.mark.parametrize("suffix", [*FORMATS, ".npz"])
def test_names_of_columns_that_are_not_utf8(suffix, tmp_path, capsys):
    """In a folder, a column is a file."""
    source, target = tmp_path / f"a{suffix}", tmp_path / "out" / f"b{suffix}"
    target.parent.mkdir()
    np.savez(source, **LINE) if suffix == ".npz" else write(source, LINE)
    assert resolve(source, target, "--columns", f"m1={ODD}") == 1
    assert_refused(capsys, target, source, "missing column caf\\xe9")
    status = resolve(source, target, "--columns", f"u1={ODD}", "--quiet")
    if suffix:
        assert status == 2
        assert_refused(capsys, target, "--columns: 'caf\\udce9': must be Unicode text")
    else:
        assert (target / f"{ODD}.npy").exists()


def test_csv_names_that_are_not_utf8(tmp_path, capsys):
    source = tmp_path / "a.csv"
    source.write_bytes(b"m1,m2,v1,v2,gr\xf6\n1,2,3,4,5\n")
    assert resolve(source, tmp_path / "b.csv") == 1
    assert "cannot be read as CSV" in capsys.readouterr().err


def test_csv_faults_are_shown_in_short_and_where_they_are(tmp_path, capsys):
    source = tmp_path / "a.csv"
    rows = "".join(f"{k},1,1,1,1\n" for k in range(2000))
    source.write_text(f"id,m1,m2,v1,v2\n{rows}abc,1,{'x' * 5000},1,1\n")
    assert resolve(source, tmp_path / "b.csv") == 1
    said = capsys.readouterr().err
    assert "column m2: row 2000: 'xxx" in said
    assert len(said) < 300
    source.write_bytes(f"id,m1,m2,v1,v2\n{rows}abc,1,1,1,1\n".encode() + b"\xff,1,1,1,1\n")
    assert resolve(source, tmp_path / "b.csv") == 1
    said = capsys.readouterr().err
    assert "abc" not in said
    assert "UTF8" in said
    source.write_text(f'id,m1,m2,v1,v2\n{rows}"abc,1,1,1,1\n{rows}{rows}')
    assert resolve(source, tmp_path / "b.csv") == 1
    assert "a quote that is not closed" in capsys.readouterr().err


def test_a_restitution_column_that_is_not_used_may_hold_anything(tmp_path):
    source = write(tmp_path / "a.csv", {**LINE, "restitution": ["?"] * N})
    assert resolve(source, tmp_path / "b.csv") == 1
    assert resolve(source, tmp_path / "b.csv", "--restitution", "0.5") == 0
    np.testing.assert_array_equal(read(tmp_path / "b.csv")["u1"], collide.resolve_1d(**LINE, restitution=0.5).u1)


def test_an_arrow_file_is_no_stream(tmp_path, capsys):
    source = write(tmp_path / "a.arrows", LINE)
    assert resolve(source, tmp_path / "b.arrow") == 2
    assert "must have the format of the input" in capsys.readouterr().err


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


def test_nested_parts_keep_their_names_and_codecs(tmp_path):
    table = pa.table({**LINE, "tags": FOREIGN["tags"].cast(pa.list_(pa.field("item", pa.int64())))})
    options = {"use_compliant_nested_type": False, "compression": {"m1": "none", "tags.list.item": "zstd"}}
    source = write(tmp_path / "a.parquet", table, **options)
    assert resolve(source, tmp_path / "b.parquet") == 0
    assert pq.read_schema(tmp_path / "b.parquet").field("tags").type.equals(table.schema.field("tags").type)
    assert pq.ParquetFile(tmp_path / "b.parquet").metadata.row_group(0).column(4).compression == "ZSTD"


def test_a_report_that_nobody_can_read_is_no_failure(tmp_path):
    source, target = write(tmp_path / "a", LINE), tmp_path / "b"
    with Path("/dev/full").open("w") as full:
        done = process.run(sys.executable, "-m", "collide", "resolve", source, "-o", target, stdout=full)
    assert (done.returncode, done.stderr) == (0, "collide: standard output: No space left on device\n")
    assert set(read(target)) == {*LINE, "u1", "u2"}


def test_one_line_whatever_the_names(tmp_path, capsys):
    source = write(tmp_path / "a", LINE)
    assert resolve(source, tmp_path / "b", "--columns", "m1=a\nb") == 1
    assert len(capsys.readouterr().err.splitlines()) == 1


def test_single_numbers_of_a_folder_are_copied_once(tmp_path):
    source = write(tmp_path / "a", {**LINE, "m2": np.array(2.0)})
    assert resolve(source, tmp_path / "b") == 0
    for name in LINE:
        assert (tmp_path / "b" / f"{name}.npy").read_bytes() == (source / f"{name}.npy").read_bytes()


@pytest.mark.parametrize("rows", [0, 700])
def test_single_numbers_of_a_folder_are_copied_however_many_rows_there_are(rows, tmp_path):
    source = write(tmp_path / "a", {**{name: column[:rows] for name, column in LINE.items()}, "m2": np.array(2.0)})
    assert resolve(source, tmp_path / "b") == 0
    assert (tmp_path / "b" / "m2.npy").read_bytes() == (source / "m2.npy").read_bytes()


def test_carriage_returns_in_csv(tmp_path):
    (tmp_path / "a.csv").write_bytes(b'm1,m2,v1,v2,note\n1,1,3,0,"a\rb"\n1,1,4,0,plain\n')
    assert resolve(tmp_path / "a.csv", tmp_path / "b.csv") == 0
    assert (tmp_path / "b.csv").read_bytes() == b'm1,m2,v1,v2,note,u1,u2\n1,1,3,0,"a\rb",0,3\n1,1,4,0,plain,0,4\n'


def test_a_name_that_is_given_is_meant(tmp_path, capsys):
    source = write(tmp_path / "a.arrow", LINE)
    assert resolve(source, tmp_path / "b.arrow", "--columns", "v1x=v1") == 1
    assert "missing column" in capsys.readouterr().err


def test_blocks_are_no_longer_than_row_groups(tmp_path):
    source = write(tmp_path / "a.parquet", LINE, row_group_size=70)
    assert resolve(source, tmp_path / "b.parquet") == 0
    groups = pq.ParquetFile(tmp_path / "b.parquet").metadata
    assert {groups.row_group(g).num_rows for g in range(groups.num_row_groups)} == {70, 20}


# Memory and overlap


def big(path, n):
    """One row group, which is worst for memory. Arrow's batches have to fit into it, and are of a usual size here."""
    table = pa.table({name: np.resize(column, n) for name, column in PLANE.items()})
    if path.suffix == ".parquet":
        write(path, table, row_group_size=n, use_dictionary=False, compression="none")
    elif path.suffix in (".arrow", ".arrows", ".feather"):
        batches = table.to_batches(max_chunksize=1 << 17)
        write(path, pa.Table.from_batches(batches))
    else:
        write(path, table if path.suffix else {name: table[name].to_numpy() for name in table.column_names})


# Not getrusage: its maximum begins with that of the process that forked.
PEAK = """
import re, sys
from collide.__main__ import main
assert main(sys.argv[1:]) == 0
print(int(re.search(r"VmHWM:\\s+(\\d+) kB", open("/proc/self/status").read())[1]) // 1024)
"""


def test_memory_does_not_grow_with_the_file(paths):
    peaks = []
    for n in (200_000, 700_000) if paths[0].suffix == ".csv" else (300_000, 5_000_000):
        big(paths[0], n)
        command = "resolve", paths[0], "-o", paths[1], "--quiet", "--overwrite"
        peaks.append(int(process.printed_by(PEAK, *command, timeout=300)))
        if paths[0].is_dir():
            shutil.rmtree(paths[0])
    # The larger files are of 320 MB (CSV 100 MB), their outputs of half as much again.
    assert peaks[1] < peaks[0] + 150
    assert peaks[1] < 1024


def test_items_are_made_ahead_in_order_in_one_thread():
    made, threads = [], set()

    def items():
        for k in range(10):
            made.append(k)
            threads.add(threading.get_ident())
            yield k

    taken = []
    for item in stream.ahead(items()):
        time.sleep(0.02)
        assert item + 1 < len(made) <= item + 4 or item >= 8  # not all of them, which would not fit
        taken.append(item)
    assert taken == list(range(10))
    assert threads.isdisjoint({threading.get_ident()})


def test_an_error_on_the_way_comes_through_after_what_was_before_it():
    def items():
        yield 1
        raise ValueError("no second")

    taken = []
    with pytest.raises(ValueError, match="no second"):
        for item in stream.ahead(items()):
            taken.append(item)
    assert taken == [1]


def test_who_stops_asking_leaves_no_thread_behind():
    before = threading.active_count()
    for item in stream.ahead(iter(range(1000))):
        if item == 3:
            break
    del item
    import gc

    gc.collect()
    assert threading.active_count() == before

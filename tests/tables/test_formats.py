"""Any format is written from any other: the bits of the batch functions, all other columns, and what cannot be held."""

import gzip
import itertools

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

import collide
from collide._tables import arrow_files, by_name, csv_files, npy_folders, npz_files, numpy_files, parquet_files
from tests.helpers import any_format, npz, process
from tests.helpers.any_format import ALL, ARROW, NUMPY, TEXT
from tests.helpers.tables import FOREIGN, LINE, PLANE, N, assert_one_line, assert_refused, read, resolve, write

pytestmark = pytest.mark.usefixtures("small_blocks")

KINDS = {
    "number": np.arange(N, dtype=np.int16),
    "share": np.linspace(0.0, 1.0, N, dtype=np.float32),
    "flag": np.arange(N) % 3 == 0,
}


@pytest.fixture
def out(tmp_path):
    """A folder of its own, so that whatever is left behind there shows."""
    (tmp_path / "out").mkdir()
    return tmp_path / "out"


@pytest.mark.parametrize(("one", "other"), [*itertools.product(ALL, ALL)])
def test_every_format_from_every_other(one, other, tmp_path, out, capsys):
    """With the other columns, whose types text does not tell; a folder has no place for text of any length."""
    others = {} if one in TEXT and other == "" else KINDS
    columns = {**others, **PLANE}
    source, target = any_format.write(tmp_path / f"a{one}", columns), out / f"b{other}"
    assert resolve(source, target) == 0
    captured = capsys.readouterr()
    assert captured.out.startswith("1,000 pairs, 0 of them invalid; ")
    assert captured.err == ""
    written, results = any_format.read(target), collide.resolve_2d(**PLANE)._asdict()
    assert set(written) == {*columns, *results}
    if "" not in (one, other):
        assert [*written] == [*columns, *results]
    for name, column in {**PLANE, **results}.items():
        np.testing.assert_array_equal(written[name].astype(float), column)
        assert other in TEXT or written[name].dtype == column.dtype
    for name, column in others.items():
        if other not in TEXT and one not in TEXT:
            np.testing.assert_array_equal(written[name], column, strict=True)
        elif one in TEXT:
            assert written[name].tolist() == [*map(str, column.tolist())]
        else:
            np.testing.assert_array_equal(written[name].astype(float).astype(column.dtype), column)
    assert list(out.iterdir()) == [target]


@pytest.mark.parametrize("other", ["", ".npz", ".parquet", ".arrow", ".csv"])
@pytest.mark.parametrize("one", ["", ".npz", ".parquet", ".arrows", ".tsv"])
def test_no_rows(one, other, tmp_path, out):
    source = any_format.write(tmp_path / f"a{one}", {name: column[:0] for name, column in LINE.items()})
    assert resolve(source, out / f"b{other}") == 0
    written = any_format.read(out / f"b{other}")
    assert {name: len(column) for name, column in written.items()} == dict.fromkeys([*LINE, "u1", "u2"], 0)


@pytest.mark.parametrize("other", [*NUMPY, *ARROW])
@pytest.mark.parametrize("one", [*NUMPY, *ARROW])
def test_float32_and_whole_numbers_stay_what_they_are(one, other, tmp_path, out):
    columns = {name: column.astype(np.float32) for name, column in LINE.items()}
    columns["m2"] = np.arange(1, N + 1, dtype=np.uint8)
    source, target = any_format.write(tmp_path / f"a{one}", columns), out / f"b{other}"
    assert resolve(source, target) == 0
    written = any_format.read(target)
    for name, column in {**columns, **collide.resolve_1d(**columns)._asdict()}.items():
        np.testing.assert_array_equal(written[name], column, strict=True)


def test_masses_that_are_true_are_numbers_in_text(tmp_path):
    columns = {**LINE, "m2": np.ones(N, bool)}
    assert resolve(any_format.write(tmp_path / "a.npz", columns), tmp_path / "b.csv") == 0
    assert resolve(tmp_path / "b.csv", tmp_path / "c.csv", "--columns", "u1=w1,u2=w2") == 0
    written = any_format.read(tmp_path / "c.csv")
    assert set(written["m2"]) == {"1"}
    assert (written["w1"] == written["u1"]).all()


# What is kept, and what is not


@pytest.mark.parametrize(
    ("column", "targets"),
    [
        ("name", [".npz", ""]),  # the first with nulls, which CSV has no word for but nothing
        ("tags", [".npz", "", ".csv", ".tsv.gz"]),
        ("nested", [".npz", "", ".csv"]),
        ("when", [".npz", ""]),
        ("price", [".npz", ""]),
    ],
)
def test_what_a_format_cannot_hold_is_named(column, targets, tmp_path, out, capsys):
    source = write(tmp_path / "a.parquet", pa.table({**LINE, column: FOREIGN[column]}))
    for target in targets:
        assert resolve(source, out / f"b{target}") == 1
        type_ = "row 8: is null" if (column, target) == ("name", ".npz") else f"has type {read(source)[column].type}"
        what = {".npz": "an .npz file", "": "a folder of .npy files"}.get(target, "CSV text")
        assert_refused(capsys, out / f"b{target}", source, f"column {column}: {type_}, which {what} cannot hold")


def test_nothing_is_written_before_what_cannot_be_held_is_said(tmp_path, out, monkeypatch):
    for module in (arrow_files, csv_files, npz_files):
        monkeypatch.delattr(module, "created")
    monkeypatch.delattr(npy_folders, "_created")
    source = write(tmp_path / "a.parquet", pa.table({**LINE, "tags": FOREIGN["tags"]}))
    for target in ("b", "b.npz", "b.csv", "b.tsv.gz"):
        assert resolve(source, out / target) == 1


def test_types_that_parquet_does_not_have(tmp_path, out, capsys):
    interval = pa.array([pa.MonthDayNano([1, 2, 3])] * N)
    source = write(tmp_path / "a.arrow", pa.table({**LINE, "interval": interval}))
    assert resolve(source, out / "b.parquet") == 1
    said = "column interval: has type month_day_nano_interval, which a .parquet file cannot hold"
    assert_refused(capsys, out / "b.parquet", source, said)
    assert resolve(source, out / "b.arrows") == 0
    assert read(out / "b.arrows").select(["interval"]).equals(read(source).select(["interval"]))


def test_text_dates_and_what_is_chosen_of_a_few(tmp_path, out):
    dates = np.array(["2020-01-01T01:02:03.000004", "NaT"] * (N // 2), "M8[us]")
    table = pa.table(
        {
            **LINE,
            "text": FOREIGN["name"].fill_null("none"),
            "kind": FOREIGN["kind"],
            "when": pa.array(dates),
            "day": pa.array(dates.astype("M8[D]")),
            "took": pa.array(dates.astype("i8") % 1000, pa.duration("ms")),
        }
    )
    source = write(tmp_path / "a.parquet", table)
    assert resolve(source, out / "b.npz") == 0
    written = any_format.read(out / "b.npz")
    assert written["text"].tolist() == table["text"].to_pylist()
    assert written["kind"].tolist() == ["x", "y"] * (N // 2)
    np.testing.assert_array_equal(written["when"], dates, strict=True)
    np.testing.assert_array_equal(written["day"], dates.astype("M8[D]"), strict=True)
    assert written["took"].dtype == "m8[ms]"
    assert resolve(out / "b.npz", out / "c.parquet", "--columns", "u1=w1,u2=w2") == 0
    after = read(out / "c.parquet")
    for name in ("text", "when", "day", "took"):
        assert after[name].combine_chunks().equals(table[name].combine_chunks()), name
    assert resolve(source, out / "d.csv") == 0
    written = any_format.read(out / "d.csv")
    assert written["text"].tolist() == table["text"].to_pylist()
    assert written["when"].tolist() == ["2020-01-01 01:02:03.000004", ""] * (N // 2)
    assert written["day"].tolist() == ["2020-01-01", ""] * (N // 2)


def test_text_of_one_length_goes_into_a_folder(tmp_path, out):
    columns = {**LINE, "name": np.array(["red", "grün"] * (N // 2)), "raw": np.array([b"ab", b"c"] * (N // 2))}
    assert resolve(any_format.write(tmp_path / "a.npz", columns), out / "b") == 0
    for name in ("name", "raw"):
        np.testing.assert_array_equal(read(out / "b")[name], columns[name], strict=True)
    assert resolve(out / "b", out / "c.csv", "--columns", "u1=w1,u2=w2") == 0
    assert any_format.read(out / "c.csv")["raw"].tolist() == ["ab", "c"] * (N // 2)
    columns["raw"] = np.array([b"\xff"] * N)
    assert resolve(any_format.write(tmp_path / "a.npz", columns), out / "d.csv") == 1


def test_text_that_numpy_would_shorten(tmp_path, out, capsys):
    texts = ["fine"] * 700 + ["cut\0"] * (N - 700)
    source = write(tmp_path / "a.parquet", pa.table({**LINE, "text": texts}))
    assert resolve(source, out / "b.npz") == 1
    assert_refused(capsys, out / "b.npz", "column text: row 700: ends with a NUL")


SHAPES = {
    "matrix": np.asfortranarray(np.arange(2.0 * N).reshape(N, 2)),
    "longer": np.arange(N + 7),
    "record": np.array([(1, 2.0)] * N, [("a", "i4"), ("b", "f4")]),
    "complex": np.full(N, 1j),
    "single": np.array(2.5),
    "big": np.linspace(0.0, 1.0, N).astype(">f8"),
    "hours": np.zeros(N, "M8[h]"),
    "quarters": np.zeros(N, "M8[15s]"),
}


@pytest.mark.parametrize(("one", "other"), [("", ".npz"), (".npz", "")])
def test_columns_of_any_shape_stay_with_numpy(one, other, tmp_path, out):
    columns = {**SHAPES, **LINE, "m2": np.array(2.0)}
    assert resolve(any_format.write(tmp_path / f"a{one}", columns), out / f"b{other}") == 0
    written = any_format.read(out / f"b{other}")
    for name, column in {**columns, **collide.resolve_1d(*(columns[c] for c in LINE))._asdict()}.items():
        assert npz.identical(written[name], column), name
        assert written[name].flags.f_contiguous == column.flags.f_contiguous


@pytest.mark.parametrize("one", ["", ".npz"])
@pytest.mark.parametrize("other", [".parquet", ".arrow", ".csv"])
@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("matrix", f"has shape ({N}, 2), not a value a row"),
        ("longer", f"has shape ({N + 7},), not a value a row"),
        ("record", "has dtype [('a', '<i4'), ('b', '<f4')]"),
        ("complex", "has dtype complex128"),
        ("hours", "has dtype datetime64[h]"),
        ("quarters", "has dtype datetime64[15s]"),
    ],
)
def test_columns_that_arrow_does_not_have(name, words, other, one, tmp_path, out, capsys):
    source = any_format.write(tmp_path / f"a{one}", {**LINE, name: SHAPES[name]})
    assert resolve(source, out / f"b{other}") == 1
    assert_refused(capsys, out / f"b{other}", source, f"column {name}: {words}, which ", " cannot hold: ")


@pytest.mark.parametrize("one", ["", ".npz"])
def test_single_numbers_stand_in_every_row(one, tmp_path, out):
    columns = {**LINE, "m2": np.array(2.0), "step": np.array(7), "big": SHAPES["big"]}
    source = any_format.write(tmp_path / f"a{one}", columns)
    assert resolve(source, out / "b.parquet") == 0
    written = any_format.read(out / "b.parquet")
    assert set(written["m2"]) == {2.0}
    assert set(written["step"]) == {7}
    np.testing.assert_array_equal(written["big"], columns["big"])
    np.testing.assert_array_equal(written["u1"], collide.resolve_1d(*(columns[c] for c in LINE)).u1)


@pytest.mark.parametrize("one", ["", ".npz"])
@pytest.mark.parametrize("other", ["", ".npz", ".parquet", ".csv"])
def test_a_table_of_single_numbers_is_one_row(one, other, tmp_path, out):
    columns = {name: column[0] for name, column in LINE.items()}
    assert resolve(any_format.write(tmp_path / f"a{one}", columns), out / f"b{other}") == 0
    u1 = any_format.read(out / f"b{other}")["u1"]
    assert u1.shape == (() if other in NUMPY else (1,))
    assert u1.astype(float) == collide.resolve_1d(**columns).u1


@pytest.mark.parametrize("other", [".npz", ".parquet"])
def test_what_cannot_be_read_of_a_folder_is_named(other, tmp_path, out, capsys):
    source = any_format.write(tmp_path / "a", LINE)
    np.save(source / "object.npy", np.array([{"a": 1}] * N, object))
    assert resolve(source, out / f"b{other}") == 1
    assert_refused(capsys, out / f"b{other}", source, "column object: ")
    (source / "object.npy").write_bytes(b"what")
    assert resolve(source, out / f"b{other}") == 1
    assert_refused(capsys, out / f"b{other}", source, "column object: is no .npy file")


@pytest.mark.parametrize("name", ["a/b", ""])
def test_names_that_no_file_can_have(name, tmp_path, out, capsys):
    source = any_format.write(tmp_path / "a.csv", {name: np.ones(N), **LINE})
    assert resolve(source, out / "b") == 1
    assert_refused(capsys, out / "b", source, f"column {name}: cannot be the name of a file")


@pytest.mark.parametrize("other", ["", ".npz"])
def test_two_columns_of_one_name(other, tmp_path, out, capsys):
    text = any_format.as_text({"x": np.ones(N), "y": np.ones(N), **LINE}).replace(b"x,y", b"x,x", 1)
    (tmp_path / "a.csv").write_bytes(text)
    assert resolve(tmp_path / "a.csv", out / f"b{other}") == 1
    assert_refused(capsys, out / f"b{other}", "column x: there are two of that name")
    assert resolve(tmp_path / "a.csv", out / "b.tsv") == 0


@pytest.mark.parametrize("one", [".csv", ".npz", ".arrow"])
def test_metadata_and_row_groups_of_a_new_parquet_file(one, tmp_path, out, monkeypatch):
    monkeypatch.setattr(parquet_files, "GROUP_BYTES", 20_000)
    if one == ".arrow":
        source = write(tmp_path / "a.arrow", pa.table(LINE).replace_schema_metadata({"from": "here"}))
    else:
        source = any_format.write(tmp_path / f"a{one}", LINE)
    assert resolve(source, out / "b.parquet") == 0
    metadata = pq.read_metadata(out / "b.parquet")
    assert metadata.num_rows == N
    *groups, _ = (metadata.row_group(g).num_rows for g in range(metadata.num_row_groups))
    assert groups  # of whole blocks
    assert all(20_000 <= 48 * rows <= 20_000 + 48 * 300 for rows in groups)
    assert one != ".arrow" or pq.read_schema(out / "b.parquet").metadata == {b"from": b"here"}


@pytest.mark.parametrize("other", [".arrow", ".arrows", ".parquet"])
def test_dictionaries_that_change_from_batch_to_batch(other, tmp_path, out):
    words = ["x", "y", None, "z"] * (N // 8), ["more", "y", "z", "x"] * (N // 8)
    table = pa.table({**LINE, "text": pa.chunked_array([pa.array(part).dictionary_encode() for part in words])})
    assert resolve(write(tmp_path / "a.arrows", table), out / f"b{other}") == 0
    assert read(out / f"b{other}")["text"].to_pylist() == [*words[0], *words[1]]


def test_an_output_of_another_format_survives_an_error_in_the_last_block(tmp_path, out, capsys):
    bad = {**LINE, "m2": np.where(np.arange(N) == N - 1, -1.0, LINE["m2"])}
    source = any_format.write(tmp_path / "a.csv", bad)
    for other in ("", ".npz", ".parquet", ".csv.gz"):
        target = any_format.write(out / f"b{other}", {"old": LINE["m1"]})
        assert resolve(source, target, "--overwrite") == 1
        assert_one_line(capsys, source, f"row {N - 1}: m2 = -1.0", f"(line {N + 1})", "--invalid nan")
        np.testing.assert_array_equal(any_format.read(target)["old"].astype(float), LINE["m1"])
    assert len(list(out.iterdir())) == 4


# Which format


def test_the_end_of_a_name_tells_the_format_whatever_its_case(tmp_path, out):
    source = any_format.write(tmp_path / "a.csv.gz", LINE).rename(tmp_path / "a.v2.CSV.GZ")
    assert resolve(source, out / "b.2026.TSV") == 0
    assert (out / "b.2026.TSV").read_bytes().startswith(b"m1\tm2\tv1\tv2\tu1\tu2\n")


def test_formats_can_be_said(tmp_path, out):
    source = any_format.write(tmp_path / "a.tsv", LINE).rename(tmp_path / "a.txt")
    assert resolve(source, out / "b.dat", "--from", "tsv", "--to", "parquet") == 0
    np.testing.assert_array_equal(pq.read_table(out / "b.dat")["u1"], collide.resolve_1d(**LINE).u1)
    assert resolve(source, out / "c.dat", "--from", "tsv", "--to", "npy") == 0
    np.testing.assert_array_equal(np.load(out / "c.dat" / "u1.npy"), collide.resolve_1d(**LINE).u1)


def test_an_output_whose_name_tells_nothing_is_a_folder(tmp_path, out, capsys):
    assert resolve(any_format.write(tmp_path / "a.parquet", LINE), out / "b") == 0
    assert set(read(out / "b")) == {*LINE, "u1", "u2"}
    assert resolve(out / "b", out / "c.out", "--columns", "u1=w1,u2=w2") == 0
    assert (out / "c.out").is_dir()
    capsys.readouterr()
    assert resolve(tmp_path / "a.parquet", out / "d.txt") == 2
    assert_refused(capsys, out / "d.txt", "must be a folder of .npy files, or one of .npz,", "--to")


@pytest.mark.parametrize(
    ("source", "options", "words"),
    [
        ("a", ["--from", "csv"], "is a folder"),
        ("a.csv", ["--from", "npy"], "is no folder"),
        ("a.csv", ["--from", "parquet"], "is no .parquet file: --from"),
        ("a.csv", ["--from", "xls"], "invalid choice: 'xls'"),
        ("a.txt", [], "must be a folder of .npy files, or one of .npz,"),
    ],
)
def test_formats_that_are_not_so(source, options, words, tmp_path, out, capsys):
    any_format.write(tmp_path / source.replace(".txt", ".csv"), LINE).rename(tmp_path / source)
    assert resolve(tmp_path / source, out / "b.csv", *options) in (1, 2)
    assert words in capsys.readouterr().err
    assert list(out.iterdir()) == []


def test_a_file_in_the_input_folder_is_no_output(tmp_path, capsys):
    source = any_format.write(tmp_path / "a", LINE)
    assert resolve(source, source / "b.parquet") == 2
    assert_refused(capsys, source / "b.parquet", "lies in the input")


def test_a_folder_that_holds_the_input_is_no_output(tmp_path, capsys):
    (tmp_path / "a").mkdir()
    source = any_format.write(tmp_path / "a" / "b.csv", LINE)
    assert resolve(source, tmp_path / "a", "--overwrite") == 2
    assert_one_line(capsys, "the input lies in it")
    assert source.exists()


def test_without_pyarrow(tmp_path):
    """NumPy's formats are written from each other, and all else is said."""
    code = "import sys; sys.modules['pyarrow'] = None; from collide.__main__ import main; sys.exit(main(sys.argv[1:]))"
    source = any_format.write(tmp_path / "a.npz", LINE)
    done = process.python(code, "resolve", source, "-o", tmp_path / "b", "--quiet")
    assert (done.returncode, done.stderr) == (0, "")
    done = process.python(code, "resolve", source, "-o", tmp_path / "b.csv")
    assert (done.returncode, done.stderr) == (2, f"collide: {tmp_path / 'b.csv'}: needs pyarrow: pip install pyarrow\n")


# Compressed


def test_compressed_text_is_the_text(tmp_path, out):
    source = any_format.write(tmp_path / "a.csv", LINE)
    for target in ("b.csv", "b.csv.gz", "c.csv.gz"):
        assert resolve(source, out / target) == 0
    assert gzip.decompress((out / "b.csv.gz").read_bytes()) == (out / "b.csv").read_bytes()
    packed = (out / "b.csv.gz").read_bytes()
    assert packed == (out / "c.csv.gz").read_bytes()
    assert packed[3:8] == bytes(5)  # neither a name nor a time


def test_compressed_text_in_several_parts(tmp_path, out):
    text = any_format.as_text(LINE)
    (tmp_path / "a.csv.gz").write_bytes(gzip.compress(text[:5000]) + gzip.compress(text[5000:]))
    assert resolve(tmp_path / "a.csv.gz", out / "b.npz") == 0
    np.testing.assert_array_equal(any_format.read(out / "b.npz")["u1"], collide.resolve_1d(**LINE).u1)


@pytest.mark.parametrize("part", [0.01, 0.5, 0.999])
@pytest.mark.parametrize("n", [20, N])  # less and more than what is read at once
def test_compressed_text_that_is_cut_off(n, part, tmp_path, out, capsys):
    packed = gzip.compress(any_format.as_text({name: column[:n] for name, column in LINE.items()}))
    source = tmp_path / "a.csv.gz"
    source.write_bytes(packed[: int(part * len(packed))])
    assert resolve(source, out / "b.csv") == 1
    assert_refused(capsys, out / "b.csv", source, "it is cut off, or damaged (Truncated compressed stream)")


def test_compressed_text_that_is_damaged(tmp_path, out, capsys):
    source = any_format.write(tmp_path / "a.csv.gz", LINE)
    packed = bytearray(source.read_bytes())
    packed[len(packed) // 2 :] = bytes(len(packed) - len(packed) // 2)
    source.write_bytes(packed)
    assert resolve(source, out / "b.csv") == 1
    assert_refused(capsys, out / "b.csv", source, "cut off, or damaged")


def test_what_comes_out_of_a_damaged_file_is_not_what_is_wrong(tmp_path, out, capsys):
    """Though it is found first: a row of three values, blocks before the end, which is missing."""
    source = any_format.write(tmp_path / "a.csv.gz", {name: np.tile(column, 5) for name, column in LINE.items()})
    lines = gzip.decompress(source.read_bytes()).splitlines(keepends=True)
    lines[20] = b"1,2,3\n"
    source.write_bytes(gzip.compress(b"".join(lines))[:-20])
    assert resolve(source, out / "b.csv") == 1
    assert_refused(capsys, out / "b.csv", source, "it is cut off, or damaged")


def test_text_that_is_not_compressed(tmp_path, out, capsys):
    any_format.write(tmp_path / "a.csv", LINE).rename(tmp_path / "a.csv.gz")
    assert resolve(tmp_path / "a.csv.gz", out / "b.csv") == 1
    assert_refused(capsys, out / "b.csv", "is no .csv.gz file: --from")


def test_dates_that_arrow_cannot_hold(tmp_path, out, capsys):
    days = np.zeros(N, np.int64)
    days[3], days[7] = np.iinfo(np.int64).min, 2**40
    source = any_format.write(tmp_path / "a.npz", {**LINE, "day": days.view("M8[D]")})
    for target in ("b.parquet", "b.arrow", "b.csv"):
        assert resolve(source, out / target) == 1
        assert_refused(capsys, out / target, source, "column day: row 7: is a date that date32[day] cannot hold")
    days[7] = 2**31 - 1
    source = any_format.write(tmp_path / "c.npz", {**LINE, "day": days.view("M8[D]")})
    assert resolve(source, out / "c.parquet") == 0
    assert pq.read_table(out / "c.parquet")["day"].cast(pa.int32()).to_pylist() == [*days[:3], None, *days[4:]]


def test_times_that_no_calendar_has(tmp_path, out, capsys):
    times = pa.array([0, None, 2**40] + [0] * (N - 3), pa.timestamp("s"))
    source = write(tmp_path / "a.parquet", pa.table({**LINE, "at": times}))
    assert resolve(source, out / "b.csv") == 1
    assert_refused(capsys, out / "b.csv", source, "column at: row 2: is a time that CSV text cannot hold")
    assert resolve(source, out / "b.npz") == 0


@pytest.mark.parametrize("more", [b"x", None], ids=["a byte", "a stream"])
def test_nothing_comes_after_a_stream(more, tmp_path, out, capsys):
    source = any_format.write(tmp_path / "a.arrows", LINE)
    source.write_bytes(source.read_bytes() + (more or source.read_bytes()))
    assert resolve(source, out / "b.arrows") == 1
    assert_refused(capsys, out / "b.arrows", source, "after the end of the stream there is more")


def test_names_that_an_archive_would_cut(tmp_path, out, capsys):
    source = write(tmp_path / "a.parquet", pa.table({**LINE, "x\0y": LINE["m1"]}))
    assert resolve(source, out / "b.npz") == 1
    assert_refused(capsys, out / "b.npz", source, "has a NUL in its name")


def test_two_columns_of_one_name_are_not_for_parquet(tmp_path, out, capsys):
    source = tmp_path / "a.csv"
    source.write_text("m1,m2,v1,v2,x,x\n1,1,3,0,a,b\n")
    assert resolve(source, out / "b.csv") == 0
    capsys.readouterr()
    assert resolve(source, out / "b.parquet") == 1
    assert_refused(capsys, out / "b.parquet", source, "column x: there are several of that name")


@pytest.mark.parametrize("suffix", ["", ".npz"])
def test_a_block_of_long_rows_has_fewer(suffix, tmp_path, out, monkeypatch):
    columns = {**LINE, "text": np.full(N, "x" * 1000)}
    source = any_format.write(tmp_path / f"a{suffix}", columns)
    monkeypatch.setattr(numpy_files, "_BLOCK_BYTES", 40_000)
    sizes = []
    run = by_name.results_of
    monkeypatch.setattr(
        by_name, "results_of", lambda c, arrays, o: sizes.append(len(arrays["v1"])) or run(c, arrays, o)
    )
    assert resolve(source, out / "b.parquet") == 0
    assert max(sizes) == 40_000 // (4 * 1000 + 4 * 8)
    assert sum(sizes) == N
    assert pq.read_table(out / "b.parquet")["text"].to_pylist() == ["x" * 1000] * N

"""CSV: text stays as it is, and what is no number is told from what is one."""

import numpy as np
import pyarrow as pa
import pyarrow.csv
import pytest

import collide
from tests.helpers import any_format
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
def test_a_number_that_csv_cannot_mean(rule, column, tmp_path, capsys, subtests):
    """It would be read as inf, and as a mass be a wall."""
    target = tmp_path / "b" / "b.csv"
    target.parent.mkdir()
    rule = rule if column in ("m1", "m2") else "keep"  # anywhere else, inf is an error of its own before
    for value in ("1e400", "-1e400", "1.7976931348623159e308", " +2e308 ", "1" + "0" * 400):
        values = [*map(repr, LINE["v1"].tolist())]
        values[7] = values[701] = "inf"
        values[901] = values[902] = value
        source = write(tmp_path / "a.csv", {**LINE, "restitution": LINE["v1"], column: values})
        with subtests.test(value=value):
            assert resolve(source, target, "--invalid", rule) == 1
            said = f"column {column}: row 901: ", "is beyond the largest number, 1.8e308"
            assert_refused(capsys, target, source, *said)


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


def test_carriage_returns_in_csv(tmp_path):
    (tmp_path / "a.csv").write_bytes(b'm1,m2,v1,v2,note\n1,1,3,0,"a\rb"\n1,1,4,0,plain\n')
    assert resolve(tmp_path / "a.csv", tmp_path / "b.csv") == 0
    assert (tmp_path / "b.csv").read_bytes() == b'm1,m2,v1,v2,note,u1,u2\n1,1,3,0,"a\rb",0,3\n1,1,4,0,plain,0,4\n'


# Other marks between the values


@pytest.mark.parametrize("option", [";", "|", "\\t", "tab", "\t", " "])
def test_another_mark_between_the_values(option, tmp_path):
    mark = {"\\t": "\t", "tab": "\t"}.get(option, option)
    (tmp_path / "a.csv").write_bytes(any_format.as_text(LINE, mark))
    assert resolve(tmp_path / "a.csv", tmp_path / "b.csv", "--delimiter", option) == 0
    results = collide.resolve_1d(**LINE)._asdict()
    assert (tmp_path / "b.csv").read_text().splitlines()[0] == mark.join([*LINE, *results])
    (tmp_path / "b.csv").rename(tmp_path / "c.csv")
    assert resolve(tmp_path / "c.csv", tmp_path / "d.npz", "--delimiter", option, "--columns", "u1=w1,u2=w2") == 0
    written = any_format.read(tmp_path / "d.npz")
    for name in ("u1", "u2"):
        np.testing.assert_array_equal(written[name.replace("u", "w")], results[name])
        np.testing.assert_array_equal(written[name].astype(float), results[name])


def test_a_value_that_holds_the_mark_is_quoted(tmp_path):
    (tmp_path / "a.tsv").write_text("m1\tm2\tv1\tv2\tnote\n1\t1\t3\t0\ta;b\n1\t1\t3\t0\ta,b\n")
    assert resolve(tmp_path / "a.tsv", tmp_path / "b.csv", "--delimiter", ";") == 0
    assert (tmp_path / "b.csv").read_text() == 'm1;m2;v1;v2;note;u1;u2\n1;1;3;0;"a;b";0;3\n1;1;3;0;a,b;0;3\n'
    assert resolve(tmp_path / "a.tsv", tmp_path / "b.tsv") == 0
    assert (tmp_path / "b.tsv").read_text().splitlines()[1] == "1\t1\t3\t0\ta;b\t0\t3"


@pytest.mark.parametrize("option", ["", ";;", "a", "1", "-", "+", ".", '"', "\n", "\xb7"])
def test_marks_that_cannot_part_values(option, tmp_path, capsys):
    source = write(tmp_path / "a.csv", LINE)
    assert resolve(source, tmp_path / "b.csv", f"--delimiter={option}") == 2
    assert "--delimiter: " in capsys.readouterr().err.replace("argument --delimiter", "--delimiter")
    assert list(tmp_path.iterdir()) == [source]


def test_a_mark_where_there_is_no_text(tmp_path, capsys):
    source = write(tmp_path / "a.parquet", LINE)
    assert resolve(source, tmp_path / "b.tsv", "--delimiter", ";") == 2
    assert_one_line(capsys, "--delimiter: neither INPUT nor OUTPUT is .csv text")


@pytest.mark.parametrize(
    ("value", "number"), [("1,5", "1.5"), ("-0,25e-3", "-0.25e-3"), (",5", ".5"), ("1.000,5", None), ("a,b", None)]
)
def test_decimal_commas(value, number, tmp_path, capsys):
    (tmp_path / "a.csv").write_text(f"m1;m2;v1;v2\n1;2;3;{value}\n")
    assert resolve(tmp_path / "a.csv", tmp_path / "b.csv", "--delimiter", ";") == 1
    (said,) = capsys.readouterr().err.splitlines()
    assert f"column v2: row 0: {value!r} is no number" in said
    assert ("decimal commas are not taken, write " + str(number) in said) == (number is not None)


# Lines

BEFORE = {
    "plain": ("m1,m2,v1,v2,note", ["1,1,3,0,x"] * 5, "\n", 7),
    "other ends": ("m1,m2,v1,v2,note", ["1,1,3,0,x"] * 5, "\r\n", 7),
    "old ends": ("m1,m2,v1,v2,note", ["1,1,3,0,x"] * 5, "\r", 7),
    "empty lines": ("\n\nm1,m2,v1,v2,note", ["1,1,3,0,x", "\n\n1,1,3,0,x"], "\n", 8),
    "values of several lines": ("m1,m2,v1,v2,note", ['1,1,3,0,"x\ny\n"', '1,1,3,0,"""\n\n"'], "\n", 8),
    "a name of several lines": ('m1,m2,v1,v2,"no\nte"', ["1,1,3,0,x"], "\n", 4),
    "a mark that begins the text": ('\ufeff"m1",m2,v1,v2,note', ["1,1,3,0,x"], "\n", 3),
    "many": ("m1,m2,v1,v2,note", ["1,1,3,0,x", '1,1,3,0,"x\ny"'] * 2000, "\n", 6002),
}


@pytest.mark.parametrize("suffix", [".csv", ".csv.gz"])
@pytest.mark.parametrize("before", BEFORE)
def test_a_row_is_named_by_its_line_too(before, suffix, tmp_path, capsys):
    """Whatever is wrong with it: it is no number, no pair, or no row."""
    names, rows, end, line = BEFORE[before]
    source, n = tmp_path / f"a{suffix}", len(rows)
    text = "".join(row + end for row in (names, *rows))
    for bad, said in {
        "1,1,fast,0,x": f"column v1: row {n}: 'fast' is no number (line {line})\n",
        "1,-1,3,0,x": f"row {n}: m2 = -1.0: a mass must be ",
        "1,1,1e400,0,x": f"column v1: row {n}: '1e400' is beyond the largest number, 1.8e308 (line {line})\n",
        "1,1,3": f"Row #{n + 2}: Expected 5 columns, got 3: 1,1,3) (line {line})\n",
    }.items():
        with any_format.opened(source, "wb") as file:
            file.write((text + bad + end + rows[0] + end).encode())
        assert resolve(source, tmp_path / "b.csv") == 1
        assert_refused(capsys, tmp_path / "b.csv", source, said, f" (line {line})\n")

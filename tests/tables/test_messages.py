"""What is said of tables that cannot be resolved: what is there, what may be meant, and what to do."""

import os
import sys
from pathlib import Path

import numpy as np
import pyarrow as pa
import pytest

from collide._tables import missing
from tests.helpers import any_format
from tests.helpers.tables import LINE, PLANE, SPACE, assert_refused, resolve, write

pytestmark = pytest.mark.fast


@pytest.fixture
def refused(tmp_path, capsys):
    """A CSV file of this text is, with these words; and what may be done about it, if it is an option, helps."""

    def check(text, *words, then=None):
        source, target = tmp_path / "a.csv", tmp_path / "out" / "b.csv"
        target.parent.mkdir(exist_ok=True)
        source.write_text(text)
        assert resolve(source, target) == 1
        assert_refused(capsys, target, source, *words)
        if then:
            assert resolve(source, target, *then) == 0
            target.unlink()
            capsys.readouterr()

    return check


def text_of(columns, delimiter=","):
    return any_format.as_text({name: column[:3] for name, column in columns.items()}, delimiter).decode()


def test_another_mark_parts_the_names(refused):
    refused(
        text_of(PLANE, ";"),
        "missing column m1, m2, v1x, v1y, v2x, v2y, nx, ny (of the 2d form); ",
        "';' seems to part the names (--delimiter ';')",
        then=["--delimiter", ";"],
    )
    refused(text_of(LINE, "\t"), "(of the 1d form); ", "(--delimiter tab)", then=["--delimiter", "tab"])
    refused(text_of(SPACE, "|"), "(of the 3d form); ", "(--delimiter '|')", then=["--delimiter", "|"])


def test_commas_where_tabs_are_meant(tmp_path, capsys):
    source, target = tmp_path / "a.tsv", tmp_path / "b.npz"
    source.write_text(text_of(LINE))
    assert resolve(source, target) == 1
    assert_refused(
        capsys, target, source, "(of the 1d form); ", "',' seems to part the names (--from csv, without --delimiter)"
    )
    assert resolve(source, target, "--from", "csv") == 0


def test_names_with_spaces_around_them(refused):
    said = "missing column m2, v1, v2 (of the 1d form); there are m1, ' m2', ' v1', ' v2': "
    names = "m2= m2,v1= v1,v2= v2"
    refused("m1, m2, v1, v2\n1, 1, 3, 0\n", said, f"(--columns '{names}')", then=["--columns", names])


def test_names_in_other_letters(refused):
    text = text_of(PLANE).replace("m1", "M1").replace("v1x", '"V1X"')
    refused(text, "missing column m1, v1x (of the 2d form); ", "(--columns m1=M1,v1x=V1X)")


def test_no_line_of_names(refused):
    lines = text_of(PLANE).splitlines(keepends=True)
    refused("".join(lines[1:]), "ny (of the 2d form); ", ": these are numbers; is the line of names missing above it?")
    lines = text_of(LINE, ";").splitlines(keepends=True)
    said = "v2 (of the 1d form); ", "(--delimiter ';'); as they are numbers, is the line of names missing above it?"
    refused("".join(lines[1:]), *said)


def test_the_form_that_fits_best(refused):
    refused(text_of({name: PLANE[name] for name in ("m1", "v1x", "v1y", "nx")}), "missing column m2, v2x, v2y, ny (of")
    refused(
        "mass,speed\n1,2\n", "missing column m1, m2, v1, v2 (of the 1d form); there are mass, speed: `columns` says"
    )


def test_many_names_are_shortened(refused):
    names = [f"column{k}" for k in range(500)]
    refused(",".join(names) + "\n", "there are column0, column1, ", "column11 and 488 more: `columns` says")
    refused(f"{'x' * 5000},m1,m2,v1\n", "there are ", "m1, m2, v1: ")
    assert len(missing.what_is_there(["y " * 5000], {"m1": "m1"})) < 200


def test_no_column_at_all(tmp_path, capsys):
    (tmp_path / "a").mkdir()
    assert resolve(tmp_path / "a", tmp_path / "b") == 1
    assert_refused(capsys, tmp_path / "b", "missing column m1, m2, v1, v2 (of the 1d form); there is no column\n")


def test_names_that_are_there_already(refused):
    text = text_of({**LINE, "u2": LINE["m1"]})
    refused(text, "column u2: is there already, ", "(--columns) calls it otherwise", then=["--columns", "u2=after"])
    refused(text_of({**PLANE, **LINE}), "more than one form: 1d, 2d; `form` (--form) says which", then=["--form", "2d"])


def test_an_invalid_pair_tells_of_the_option(refused):
    text = text_of({**LINE, "m1": np.array([-1.0, 1.0, -1.0])})
    said = (
        "row 0: m1 = -1.0: a mass must be ",
        " (2 invalid pairs up to row 2); --invalid keep or --invalid nan goes on",
    )
    refused(text, *said, then=["--invalid", "nan"])


# Files


@pytest.mark.parametrize("suffix", [".npz", ".parquet", ".arrow", ".csv.gz"])
@pytest.mark.parametrize("content", [b"", b"nonsense", b"m1,m2,v1,v2\n1,2,3,4\n", bytes(1000)])
def test_what_is_of_no_format(content, suffix, tmp_path, capsys):
    source, target = tmp_path / f"a{suffix}", tmp_path / "out" / "b.csv"
    target.parent.mkdir()
    source.write_bytes(content)
    assert resolve(source, target) == 1
    assert_refused(capsys, target, f"{source}: is no {suffix} file: --from says what else it is\n")


@pytest.mark.parametrize("named", [".npz", ".parquet", ".arrow", ".csv.gz", ".csv"])
@pytest.mark.parametrize("really", [".npz", ".parquet", ".arrow", ".arrows", ".csv.gz"])
def test_what_is_of_another_format(named, really, tmp_path, capsys):
    if named == really:
        return
    target = tmp_path / "out" / "b.npz"
    target.parent.mkdir()
    source = any_format.write(tmp_path / f"a{really}", LINE).rename(tmp_path / f"b{named}")
    assert resolve(source, target) == 1
    said = f"; it begins as a {really} file does: --from {really[1:]}\n"
    assert_refused(capsys, target, source, said, "" if named == ".csv" else f"is no {named} file; ")
    assert resolve(source, target, "--from", really[1:]) == 0


@pytest.mark.parametrize("suffix", [".npz", ".parquet", ".arrow", ".csv", ".tsv.gz", ""])
def test_what_may_not_be_read(suffix, tmp_path, monkeypatch, capsys):
    source, target = any_format.write(tmp_path / f"a{suffix}", LINE), tmp_path / "out" / "b.npz"
    target.parent.mkdir()

    def forbidden(path, *arguments, **options):
        raise PermissionError(13, "Permission denied", str(path))

    monkeypatch.setattr(Path, "open", forbidden)  # root may read anything
    monkeypatch.setattr(pa, "OSFile", forbidden)
    assert resolve(source, target) == 1
    where = "column m1: " if suffix == "" else ""
    assert_refused(capsys, target, f"{source}: {where}cannot be read (Permission denied)\n")


def test_what_is_not_there(tmp_path, capsys):
    assert resolve(tmp_path / "a.csv", tmp_path / "b.csv") == 2
    assert_refused(capsys, tmp_path / "b.csv", f"a.csv: no such file (looked for in {tmp_path})\n")
    source = write(tmp_path / "a.csv", LINE)
    assert resolve(source, tmp_path / "no" / "b.csv") == 2
    assert_refused(capsys, tmp_path / "b.csv", f"{tmp_path / 'no'}: no such folder: it has to be made before\n")


def test_a_pipe_with_a_name_is_read_as_standard_input(tmp_path, capsys):
    if sys.platform == "win32" or not hasattr(os, "mkfifo"):
        pytest.skip("Windows has no os.mkfifo: no file there is a pipe")
    os.mkfifo(tmp_path / "a.csv")
    assert resolve(tmp_path / "a.csv", tmp_path / "b.csv") == 2
    assert_refused(capsys, tmp_path / "b.csv", "is not a file: from a pipe it is read by - (collide resolve - --from")


def test_a_damaged_file_keeps_its_own_error(tmp_path, capsys):
    source = any_format.write(tmp_path / "a.npz", LINE)
    source.write_bytes(source.read_bytes()[:500])
    assert resolve(source, tmp_path / "b.npz") == 1
    assert_refused(capsys, tmp_path / "b.npz", "cannot be read as a .npz file of plain arrays (")
    source = write(tmp_path / "a.parquet", pa.table(LINE))
    source.write_bytes(source.read_bytes()[:500])
    assert resolve(source, tmp_path / "b.npz") == 1
    assert_refused(capsys, tmp_path / "b.npz", "cannot be read as Parquet (")

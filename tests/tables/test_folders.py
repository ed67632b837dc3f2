"""Folders of .npy columns."""

import numpy as np
import pytest

import collide
from collide._tables import npy_folders
from collide._tables.by_name import TableError
from tests.helpers.tables import (
    LINE,
    N,
    assert_refused,
    read,
    resolve,
    write,
)

pytestmark = [pytest.mark.fast, pytest.mark.usefixtures("small_blocks")]


def test_a_column_whose_name_is_anothers_to_the_system_is_an_error(tmp_path):
    """V1.npy is v1.npy to Windows and, as a rule, to macOS."""
    (tmp_path / "v1.npy").write_text("another column")
    with pytest.raises(TableError, match="column v1: there is one whose name is the same to this system"):
        npy_folders._created(tmp_path, "v1")
    assert (tmp_path / "v1.npy").read_text() == "another column"


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


def test_a_folder_of_single_numbers(tmp_path):
    write(tmp_path / "a", {name: column[0] for name, column in LINE.items()})
    assert resolve(tmp_path / "a", tmp_path / "b") == 0
    np.testing.assert_array_equal(
        np.load(tmp_path / "b" / "u1.npy"), collide.resolve_1d(*(c[0] for c in LINE.values()))[0]
    )


@pytest.mark.parametrize("name", ["../evil", "a/b", "/tmp/evil"])
def test_a_column_is_not_written_elsewhere(name, tmp_path, capsys):
    source = write(tmp_path / "a", LINE)
    (tmp_path / "out").mkdir()
    target = tmp_path / "out" / "b"
    assert resolve(source, target, "--columns", f"u1={name}") == 1
    assert_refused(capsys, target, f"column {name}: cannot be the name of a file")


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

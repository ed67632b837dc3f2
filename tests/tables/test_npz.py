"""Archives of columns, .npz: every column stays, and what is wrong with one is said in one line."""

import os
import zipfile
from pathlib import Path

import numpy as np
import pytest

import collide
from tests.helpers import tables
from tests.helpers.npz import (
    FORMS,
    LINE,
    PLANE,
    POLAR,
    SPACE,
    N,
    assert_refused,
    assert_resolved,
    identical,
    read,
    without,
    write,
)
from tests.helpers.tables import resolve

# What is written


@pytest.mark.parametrize("form", FORMS)
def test_output_is_the_input_and_the_batch_result(form, source, target, capsys):
    columns, function = FORMS[form]
    write(source, columns)
    before = source.read_bytes()
    assert resolve(source, target) == 0
    captured = capsys.readouterr()
    assert captured.out.startswith("100 pairs, 0 of them invalid; relative change of total momentum ")
    assert captured.err == ""  # no bar where nobody looks
    assert_resolved(columns, target, function(**columns))
    assert source.read_bytes() == before
    assert list(target.parent.iterdir()) == [target]


@pytest.mark.fast
def test_foreign_columns_pass_through_unchanged(source, target):
    columns = {
        "name": np.array(["red", "grün", ""]),
        "m1": np.array([1, 2, 3], np.uint8),
        "big_endian": np.array([1.5, -0.0, np.nan], ">f8"),
        "m2": np.array([1.0, 2.0, 3.0]),
        "when": np.array(["2020-01-01", "NaT", "2021-01-01"], "datetime64[s]"),
        "v1": np.array([1.0, 2.0, 3.0]),
        "longer": np.arange(7),
        "v2": np.array([-1.0, -2.0, -3.0]),
        "matrix": np.asfortranarray(np.arange(6.0).reshape(2, 3)),
        "record": np.array([(1, 2.0)], [("a", "i4"), ("b", "f4")]),
        "u1x": np.array(1j),  # an output of another form
    }
    write(source, columns)
    assert resolve(source, target) == 0
    assert_resolved(columns, target, collide.resolve_1d(*(columns[c] for c in ("m1", "m2", "v1", "v2"))))


@pytest.mark.parametrize("name", ["file", "allow_pickle", "self", "args", "a b/c"])
def test_foreign_column_of_any_name(name, source, target):
    columns = {**LINE, name: np.arange(3)}
    write(source, columns)
    assert resolve(source, target) == 0
    assert_resolved(columns, target, collide.resolve_1d(**LINE))


def test_compressed_input(source, target):
    np.savez_compressed(source, **LINE)
    assert resolve(source, target) == 0
    assert_resolved(LINE, target, collide.resolve_1d(**LINE))


@pytest.mark.parametrize("form", FORMS)
def test_restitution_column_is_used(form, source, target):
    columns, function = FORMS[form]
    columns = {"restitution": tables.RNG.uniform(0.0, 1.0, N), **columns}
    write(source, columns)
    assert resolve(source, target) == 0
    assert_resolved(columns, target, function(**columns))


@pytest.mark.fast
@pytest.mark.parametrize("scalars", [("m1",), ("m1", "m2", "v1", "v2")], ids=["one", "all"])
def test_scalar_columns(scalars, source, target):
    columns = {name: column[0] if name in scalars else column for name, column in LINE.items()}
    write(source, columns)
    assert resolve(source, target) == 0
    assert_resolved(columns, target, collide.resolve_1d(**columns))


def test_float32_columns(source, target):
    columns = {name: column.astype(np.float32) for name, column in PLANE.items()}
    write(source, columns)
    assert resolve(source, target) == 0
    assert_resolved(columns, target, collide.resolve_2d(**columns))
    assert read(target)["u1x"].dtype == np.float32


def test_empty_columns(source, target):
    columns = {name: column[:0] for name, column in POLAR.items()}
    write(source, columns)
    assert resolve(source, target) == 0
    assert_resolved(columns, target, collide.resolve_polar(**columns))


def test_approaching_only(source, target):
    write(source, LINE)
    assert resolve(source, target, "--approaching-only") == 0
    assert_resolved(LINE, target, collide.resolve_1d(**LINE, approaching_only=True))
    assert not identical(read(target)["u1"], collide.resolve_1d(**LINE).u1)


def test_replaces_an_existing_output(source, target):
    write(source, LINE)
    target.write_text("old")
    assert resolve(source, target, "--overwrite") == 0
    assert_resolved(LINE, target, collide.resolve_1d(**LINE))


def test_output_behind_a_link_is_replaced_and_the_link_stays(source, target):
    write(source, LINE)
    link = source.with_name("link.npz")
    link.symlink_to(target)
    target.write_text("old")
    assert resolve(source, link, "--overwrite") == 0
    assert link.readlink() == target
    assert_resolved(LINE, target, collide.resolve_1d(**LINE))


@pytest.mark.unix
@pytest.mark.parametrize(("umask", "mode"), [(0o022, 0o644), (0o027, 0o640), (0o077, 0o600)])
def test_permissions_of_a_new_output_follow_the_umask(umask, mode, source, target):
    write(source, LINE)
    before = os.umask(umask)
    try:
        assert resolve(source, target) == 0
    finally:
        os.umask(before)
    assert target.stat().st_mode & 0o777 == mode


BAD_TABLES = {
    "missing column": (without(LINE, "v2"), ["v2"]),
    "missing columns": (without(PLANE, "m1", "ny"), ["m1", "ny", "2d"]),
    "missing polar column": (without(POLAR, "phi", "v1"), ["phi", "v1", "polar"]),
    "missing column in the plane": (
        without(PLANE, "nx"),
        ["column nx (of the 2d form); there are m1, m2, v1x, v1y, v2x, v2y, ny: "],
    ),
    "missing column in space": (
        without(SPACE, "v2x"),
        ["column v2x (of the 3d form); there are m1, ", ": `columns` says which is which (--columns v2x=NAME)\n"],
    ),
    "missing columns in space": (
        without(SPACE, "nz", "v1z"),
        ['column v1z, nz (of the 3d form); form="2d" (--form 2d)'],
    ),
    "two forms": (PLANE | POLAR, ["2d", "polar"]),
    "two forms, one of them on a line": (PLANE | LINE, ["1d", "2d"]),
    "two forms, one of them in space": (SPACE | POLAR, ["3d", "polar"]),
    "no form": ({"x": np.arange(3.0)}, ["missing column", "m1"]),
    "no column": ({}, ["missing column", "m1"]),
    "too short": (LINE | {"v1": np.ones(98)}, ["column v1", "98", "100", "row 98"]),
    "too long": (PLANE | {"ny": np.ones(103)}, ["column ny", "103", "100", "row 100"]),
    "one row": (LINE | {"m2": np.ones(1)}, ["column m2", "row 1"]),
    "wrong restitution length": (LINE | {"restitution": np.ones(99)}, ["column restitution", "row 99"]),
    "two dimensions": (LINE | {"m2": np.ones((100, 1))}, ["column m2", "2 dimensions"]),
    "text": (LINE | {"v1": np.full(100, "fast")}, ["column v1", "<U4"]),
    "bytes": (LINE | {"v1": np.array(b"fast")}, ["column v1", "S4"]),
    "complex": (LINE | {"v2": np.ones(100, complex)}, ["column v2", "complex128"]),
    "longdouble": (LINE | {"v2": np.ones(100, np.longdouble)}, ["column v2", "float"]),
    "dates": (LINE | {"m1": np.full(100, "2020", "datetime64[Y]")}, ["column m1", "datetime64"]),
    "output there already": (LINE | {"u2": np.ones(100)}, ["column u2"]),
    "output there already, polar": (POLAR | {"u2x": np.ones(3)}, ["column u2x"]),
}


@pytest.mark.fast
@pytest.mark.parametrize("case", BAD_TABLES)
def test_bad_table_is_refused(case, source, target, capsys):
    columns, words = BAD_TABLES[case]
    write(source, columns)
    assert resolve(source, target) == 1
    assert_refused(capsys, target, source, *words)


class Touching:
    """Its pickle, when loaded, creates a file."""

    def __init__(self, path):
        self.path = path

    def __reduce__(self):
        return Path.touch, (self.path,)


@pytest.mark.fast
@pytest.mark.parametrize("name", ["m1", "foreign"])
def test_object_column_is_refused_unloaded(name, source, target, tmp_path, capsys):
    marker = tmp_path / "loaded"
    write(source, LINE | {name: np.array([Touching(marker)], object)})
    assert resolve(source, target) == 1
    assert_refused(capsys, target, source, f"column {name}")
    assert not marker.exists()


def test_object_array_in_place_of_a_table_is_refused_unloaded(source, target, tmp_path, capsys):
    marker = tmp_path / "loaded"
    with source.open("wb") as file:
        np.save(file, np.array([Touching(marker)], object))
    assert resolve(source, target) == 1
    assert_refused(capsys, target, source)
    assert not marker.exists()


@pytest.mark.parametrize("content", [b"", b"m1,m2\n1,2\n", b"PK\x03\x04", bytes(1000)])
def test_file_that_is_no_table_is_refused(content, source, target, capsys):
    source.write_bytes(content)
    assert resolve(source, target) == 1
    assert_refused(capsys, target, source)


def test_plain_array_is_refused(source, target, capsys):
    with source.open("wb") as file:
        np.save(file, np.ones(3))
    assert resolve(source, target) == 1
    assert_refused(capsys, target, source, ".npz")


# Half of a file is no zip file; without its last bytes it is not either.
@pytest.mark.fast
@pytest.mark.parametrize("part", [0.1, 0.5, 0.99])
def test_truncated_table_is_refused(part, source, target, capsys):
    write(source, LINE)
    source.write_bytes(source.read_bytes()[: int(part * source.stat().st_size)])
    assert resolve(source, target) == 1
    assert_refused(capsys, target, source)


def test_damaged_column_is_refused(source, target, capsys):
    write(source, LINE)
    content = source.read_bytes()
    place = content.index(LINE["v1"].tobytes()[:32])
    source.write_bytes(content[:place] + b"\xff" + content[place + 1 :])  # now against its checksum
    assert resolve(source, target) == 1
    assert_refused(capsys, target, source, "column v1")


def test_damaged_compression_is_refused(source, target, capsys):
    np.savez_compressed(source, **LINE)
    with zipfile.ZipFile(source) as archive:
        member = archive.getinfo("m1.npy")
    content = bytearray(source.read_bytes())
    head = member.header_offset
    name, extra = (int.from_bytes(content[head + at : head + at + 2], "little") for at in (26, 28))
    content[head + 30 + name + extra] |= 0b110  # a kind of block that deflate does not have
    source.write_bytes(content)
    assert resolve(source, target) == 1
    assert_refused(capsys, target, source, "column m1")


# In the central directory: 8 bytes in stand the flags, 10 bytes in the compression method.
@pytest.mark.parametrize(("offset", "value"), [(8, 1), (10, 99)], ids=["encrypted", "unknown compression"])
def test_unreadable_zip_member_is_refused(offset, value, source, target, capsys):
    write(source, LINE)
    content = bytearray(source.read_bytes())
    content[content.index(b"PK\x01\x02") + offset] = value
    source.write_bytes(content)
    assert resolve(source, target) == 1
    assert_refused(capsys, target, source, "column m1")


def test_column_larger_than_memory_is_refused(source, target, capsys):
    write(source, without(LINE, "m1"))
    with zipfile.ZipFile(source, "a") as archive, archive.open("m1.npy", "w") as file:
        np.lib.format.write_array_header_1_0(file, {"descr": "<f8", "fortran_order": False, "shape": (1 << 56,)})
    assert resolve(source, target) == 1
    assert_refused(capsys, target, source, "column m1")


def test_member_that_is_no_array_is_refused(source, target, capsys):
    write(source, without(LINE, "m1"))
    with zipfile.ZipFile(source, "a") as archive:
        archive.writestr("m1", "1 2 3")
    assert resolve(source, target) == 1
    assert_refused(capsys, target, source, "m1")


# Invalid pairs

INVALID = LINE | {"m2": np.where(np.arange(100) == 42, -1.0, LINE["m2"])}


@pytest.mark.fast
def test_invalid_pair_is_refused_with_its_row(source, target, capsys):
    write(source, INVALID)
    assert resolve(source, target) == 1
    assert_refused(capsys, target, source, "row 42", "m2 = -1.0")


def test_several_invalid_pairs_are_counted(source, target, capsys):
    write(source, INVALID | {"v1": np.where(np.arange(100) > 97, np.nan, LINE["v1"])})
    assert resolve(source, target, "--invalid", "raise") == 1
    assert_refused(capsys, target, source, "row 42", "m2 = -1.0", "3 invalid pairs up to row 99")


@pytest.mark.fast
def test_existing_output_survives_an_error(source, target):
    write(source, INVALID)
    target.write_text("old")
    assert resolve(source, target, "--overwrite") == 1
    assert target.read_text() == "old"
    assert list(target.parent.iterdir()) == [target]


@pytest.mark.fast
@pytest.mark.parametrize("rule", ["keep", "nan"])
def test_invalid_pairs_are_written_on_request(rule, source, target):
    write(source, INVALID)
    assert resolve(source, target, "--invalid", rule) == 0
    assert_resolved(INVALID, target, collide.resolve_1d(**INVALID, invalid=rule))

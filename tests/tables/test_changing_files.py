"""A file that another process changes while it is read: one line, and nothing left behind. Each format has a process of
its own, which a signal (SIGBUS) would end.
"""

import json
import os
import zipfile

import numpy as np
import pytest

from collide._tables import arrow_files, npy_folders, parquet_files, stream
from tests.helpers import process
from tests.helpers.tables import FEW, LINE, assert_refused, resolve, write

MANY = {name: np.resize(column, 30_000) for name, column in LINE.items()}  # a hundred blocks

# Runs the command line again and again; at the given block, something is done to the file.
CHANGING = """
import contextlib, io, json, os, shutil, sys
from pathlib import Path
from collide._tables import arrow_files, csv_files, stream
from collide.__main__ import main

source, target = map(Path, sys.argv[1:3])
stream.ROWS, arrow_files.BLOCK_BYTES, csv_files._TEXT_BYTES = 300, 1 << 15, 1 << 14
resolve = stream.by_name.results_of
file = source / "v1.npy" if source.is_dir() else source
content = file.read_bytes()
shutil.copyfile(file, source.with_name("spare"))


def cut(n):
    os.truncate(file, n)


def add(n):
    with file.open("ab") as more:
        more.write(content[-n:])


def run(block, change, n):
    calls = []

    def resolving(*arguments):
        if len(calls) == block:
            change(n)
        calls.append(0)
        return resolve(*arguments)

    file.write_bytes(content)
    stream.by_name.results_of = resolving
    said = io.StringIO()
    with contextlib.redirect_stderr(said), contextlib.redirect_stdout(said):
        status = main(["resolve", str(source), "-o", str(target)])
    left = sorted(path.name for path in target.parent.iterdir())
    return [change.__name__, block, n, status, said.getvalue(), left]


half, most = len(content) // 2, len(content) * 9 // 10
# The first call is for the types, before anything is read; at the end of the file there may be something else.
runs = [(0, cut, 0), (0, cut, half), (1, cut, 0), (2, cut, half), (2, cut, half + 1), (30, cut, most), (60, cut, most)]
print(json.dumps([run(*r) for r in [*runs, (1, add, 1), (1, add, 5000), (50, add, 100)]]))
"""


@pytest.fixture(params=FEW, ids=lambda suffix: suffix or "folder")
def changed(request, tmp_path):
    """What a run ends with, for several changes at several moments."""
    (tmp_path / "out").mkdir()
    source, target = tmp_path / f"pairs{request.param}", tmp_path / "out" / f"after{request.param}"
    write(source, MANY)
    return source, json.loads(process.printed_by(CHANGING, source, target))


def test_a_file_that_changes_while_it_is_read(changed):
    source, runs = changed
    assert len(runs) == 10
    for change, block, n, status, said, left in runs:
        case = f"{change} {n} at block {block}"
        assert (status, left) == (1, []), case
        assert said.startswith(f"collide: {source}: "), case
        assert len(said.splitlines()) == 1, case
        assert "while it was read" in said, case


@pytest.mark.parametrize("n_bytes", [0, 5000, 20_000])
def test_a_column_that_does_not_collide_and_changes_while_it_is_copied(n_bytes, tmp_path, monkeypatch, capsys):
    source, target = write(tmp_path / "a", LINE), tmp_path / "out" / "b"
    target.parent.mkdir()
    (source / "other.npy").write_bytes(bytes(10_000))
    size = stream.size

    def changing(handle):
        n = size(handle)
        if n == 10_000:
            os.truncate(source / "other.npy", n_bytes)
        return n

    monkeypatch.setattr(npy_folders, "size", changing)
    assert resolve(source, target) == 1
    assert_refused(capsys, target, source, "column other: the file has changed while it was read, from 10,000 to")


def test_rows_that_a_parquet_file_does_not_have(tmp_path, monkeypatch, capsys):
    """For pyarrow, what is not there is the end."""
    source, target = write(tmp_path / "a.parquet", LINE), tmp_path / "out" / "b.parquet"
    target.parent.mkdir()
    select = parquet_files.Parquet.select

    def selecting(self, columns):
        os.truncate(source, 0)
        return select(self, columns)

    monkeypatch.setattr(parquet_files.Parquet, "select", selecting)
    monkeypatch.setattr(arrow_files, "check_size", lambda handle, n_bytes, where: None)
    assert resolve(source, target) == 1
    assert_refused(capsys, target, source, "row 0: cannot be read (there are 0 rows, not 1,000)")


@pytest.mark.parametrize("compressed", [False, True])
def test_an_archive_that_is_truncated_while_it_is_read(compressed, tmp_path, monkeypatch, capsys):
    source, target = tmp_path / "a.npz", tmp_path / "out" / "b.npz"
    target.parent.mkdir()
    # More than is read ahead, which is 128 KiB from Python 3.14 on.
    columns = dict(zip(MANY, np.random.default_rng(0).random((len(MANY), 30_000)), strict=True))
    (np.savez_compressed if compressed else np.savez)(source, **columns)
    zip_open = zipfile.ZipFile.open

    def truncating(archive, name, *rest, **options):
        if "v1" in str(name):
            os.truncate(source, archive.getinfo("v1.npy").header_offset + 1000)
        return zip_open(archive, name, *rest, **options)

    monkeypatch.setattr(zipfile.ZipFile, "open", truncating)
    assert resolve(source, target) == 1
    assert_refused(capsys, target, source, "column v1: cannot be read")

"""What becomes of the output: it appears whole or not at all, and replaces only what it is meant to replace."""

import ctypes
import os
import signal
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest

from collide._system import disk, renaming
from collide._tables import by_name, replacement
from tests.helpers import elsewhere, process
from tests.helpers.tables import (
    LINE,
    N,
    assert_one_line,
    assert_refused,
    few_formats,
    read,
    resolve,
    write,
)

pytestmark = pytest.mark.usefixtures("small_blocks")


@pytest.mark.fast
def test_an_output_is_replaced(paths):
    write(paths[0], LINE)
    write(paths[1], {**LINE, "old": LINE["m1"]})
    assert resolve(*paths, "--overwrite") == 0
    assert "old" not in (read(paths[1]) if paths[1].is_dir() else read(paths[1]).column_names)
    assert list(paths[1].parent.iterdir()) == [paths[1]]


@pytest.mark.fast
def test_an_output_survives_an_error_in_the_last_block(paths):
    write(paths[0], {**LINE, "m2": np.where(np.arange(N) == N - 1, -1.0, LINE["m2"])})
    write(paths[1], {"old": LINE["m1"]})
    assert resolve(*paths, "--overwrite") == 1
    np.testing.assert_array_equal(np.asarray(read(paths[1])["old"]), LINE["m1"])
    assert list(paths[1].parent.iterdir()) == [paths[1]]


def test_without_the_systems_exchange_a_folder_is_replaced_in_steps(tmp_path, monkeypatch):
    write(tmp_path / "a", LINE)
    write(tmp_path / "b", {"old": LINE["m1"]})
    monkeypatch.setattr(ctypes, "CDLL", lambda name, **options: object())
    assert resolve(tmp_path / "a", tmp_path / "b", "--overwrite") == 0
    assert set(read(tmp_path / "b")) == {*LINE, "u1", "u2"}
    assert sorted(tmp_path.iterdir()) == [tmp_path / "a", tmp_path / "b"]


def test_a_folder_that_cannot_be_replaced_comes_back(tmp_path, monkeypatch, capsys):
    write(tmp_path / "a", LINE)
    write(tmp_path / "b", {"old": LINE["m1"]})
    monkeypatch.setattr(ctypes, "CDLL", lambda name, **options: object())
    rename, calls = Path.rename, []

    def failing(self, target):
        calls.append(target)
        if len(calls) == 2:
            raise OSError(5, "Input/output error")
        return rename(self, target)

    monkeypatch.setattr(Path, "rename", failing)
    assert resolve(tmp_path / "a", tmp_path / "b", "--overwrite") == 1
    assert capsys.readouterr().err == f"collide: {tmp_path / 'b'}: Input/output error\n"
    assert set(read(tmp_path / "b")) == {"old"}
    assert sorted(tmp_path.iterdir()) == [tmp_path / "a", tmp_path / "b"]


@pytest.mark.parametrize("inside", ["in.npy", "in"])
def test_a_folder_with_folders_in_it_is_not_replaced(inside, tmp_path, capsys):
    source, target = write(tmp_path / "a", LINE), tmp_path / "out"
    target.mkdir()
    inner = write(target / "in", LINE).rename(target / inside)
    assert resolve(source, target, "--overwrite") == 2
    assert "not a folder of .npy files only" in capsys.readouterr().err
    assert len(list(inner.iterdir())) == len(LINE)


def test_a_folder_with_anything_else_in_it_is_not_replaced(tmp_path, capsys):
    write(tmp_path / "a", LINE)
    write(tmp_path / "b", {"old": LINE["m1"]})
    (tmp_path / "b" / "thesis.tex").write_text("years of work")
    assert resolve(tmp_path / "a", tmp_path / "b") == 2
    assert "not a folder of .npy files only" in capsys.readouterr().err
    assert (tmp_path / "b" / "thesis.tex").read_text() == "years of work"


@pytest.mark.unix
@few_formats
def test_a_full_disk(paths, capsys):
    """A limit on the size of files stands for it: the same error at the same place."""
    write(paths[0], LINE)
    write(paths[1], {"old": LINE["m1"]})
    limit = 9000 if paths[0].is_dir() else 30_000
    small = f"import resource; resource.setrlimit(resource.RLIMIT_FSIZE, ({limit}, {limit}))"
    command = f"{small}; import sys; from collide.__main__ import main; sys.exit(main(sys.argv[1:]))"
    if paths[0].is_dir():
        np.save(paths[0] / "m1.npy", np.ones(N, np.float32))  # so that its copy fits, and a result does not
        np.save(paths[0] / "other.npy", np.ones(2 * N))
    done = process.python(command, "resolve", paths[0], "-o", paths[1], "--overwrite")
    assert done.returncode == 1
    assert done.stderr == f"collide: {paths[1]}: File too large\n"
    np.testing.assert_array_equal(np.asarray(read(paths[1])["old"]), LINE["m1"])
    assert list(paths[1].parent.iterdir()) == [paths[1]]


STOPPED = """
import sys
from collide._tables import by_name, csv_files, stream
from collide.__main__ import main

stream.ROWS = 300
csv_files._TEXT_BYTES = 1 << 14
resolve = by_name.results_of
calls = []

def slow(*arguments):
    calls.append(0)
    if len(calls) == 4:
        print("writing", flush=True)
        sys.stdin.readline()
    return resolve(*arguments)

by_name.results_of = slow
sys.exit(main(sys.argv[1:]))
"""


@few_formats
@pytest.mark.parametrize(("how", "status"), [("kill", -9), ("terminate", 143)])
def test_a_run_that_is_stopped_leaves_the_old_output(how, status, paths):
    write(paths[0], LINE)
    write(paths[1], {"old": LINE["m1"]})
    command = sys.executable, "-c", STOPPED, "resolve", paths[0], "-o", paths[1], "--overwrite"
    with process.running(*command, stdin=process.PIPE) as stopped:
        assert stopped.stdout.readline() == "writing\n"
        getattr(stopped, how)()
        time.sleep(0.3)  # in which the signal arrives
        stopped.communicate("\n", timeout=60)
        assert stopped.returncode == status
    np.testing.assert_array_equal(np.asarray(read(paths[1])["old"]), LINE["m1"])
    if how == "terminate":
        assert list(paths[1].parent.iterdir()) == [paths[1]]


def test_an_interrupt_leaves_the_old_output(paths, monkeypatch, capsys):
    results_of, calls = by_name.results_of, []

    def interrupted(*arguments):
        calls.append(0)
        if len(calls) == 3:
            signal.raise_signal(signal.SIGINT)
        return results_of(*arguments)

    monkeypatch.setattr(by_name, "results_of", interrupted)
    write(paths[0], LINE)
    write(paths[1], {"old": LINE["m1"]})
    assert resolve(*paths, "--overwrite") == 130
    assert capsys.readouterr().err == "collide: interrupted\n"
    np.testing.assert_array_equal(np.asarray(read(paths[1])["old"]), LINE["m1"])
    assert list(paths[1].parent.iterdir()) == [paths[1]]


@pytest.mark.unix
def test_a_folder_has_the_rights_of_a_new_one(tmp_path):
    before = os.umask(0o027)
    try:
        assert resolve(write(tmp_path / "a", LINE), tmp_path / "b") == 0
    finally:
        os.umask(before)
    assert (tmp_path / "b").stat().st_mode & 0o777 == 0o750


def test_what_is_written_is_on_the_disk_before_it_has_its_name(paths, monkeypatch):
    synced, fsync = [], os.fsync

    def noting(handle):
        synced.append(Path(f"/proc/self/fd/{handle}").readlink().name)
        assert not paths[1].exists()
        fsync(handle)

    monkeypatch.setattr(os, "fsync", noting)
    write(paths[0], LINE)
    assert resolve(*paths) == 0
    n_folders = 0 if elsewhere.SYSTEM == "windows" else 1  # where a folder cannot be
    assert len(set(synced)) == (n_folders + len(list(paths[1].iterdir())) if paths[1].is_dir() else 1)


def test_much_of_it_is_on_the_disk_before_all_is_written(paths, monkeypatch):
    """At the end there is little to wait for."""
    done, fsync = threading.Event(), os.fsync

    def telling(handle):
        fsync(handle)
        done.set()

    def slow(*arguments):
        assert done.wait(10.0)
        return results_of(*arguments)

    results_of = by_name.results_of
    write(paths[0], LINE)
    monkeypatch.setattr(os, "fsync", telling)
    monkeypatch.setattr(replacement, "_PAUSE", 0.001)
    monkeypatch.setattr(by_name, "results_of", lambda *a: (slow if a[1]["m1"].size else results_of)(*a))
    assert resolve(*paths) == 0


def test_an_error_of_the_disk_that_is_told_once(paths, monkeypatch, capsys):
    """By the first fsync after it; for the next one, all is well."""
    told = []

    def telling(handle):
        told.append(handle)
        if len(told) == 1:
            raise OSError(5, "Input/output error")

    monkeypatch.setattr(os, "fsync", telling)
    monkeypatch.setattr(replacement, "_PAUSE", 0.0)
    write(paths[0], LINE)
    assert resolve(*paths) == 1
    assert_refused(capsys, paths[1], f"{paths[1]}: Input/output error")


@pytest.mark.unix
def test_a_replaced_output_keeps_its_rights(paths):
    write(paths[0], LINE)
    write(paths[1], {"old": LINE["m1"]})
    paths[1].chmod(0o750)
    assert resolve(*paths, "--overwrite") == 0
    assert paths[1].stat().st_mode & 0o777 == 0o750


# What is there


def folder_of(name):
    def make(path):
        path.mkdir()
        (path / name).write_bytes(b"years of work")

    return make


# What may be at the output's place, and whether --overwrite replaces it: by a file, by a folder.
THERE = {
    "a file": (lambda path: path.write_text("old"), True, False),
    "a folder of columns": (folder_of("important.npy"), False, True),
    "an empty folder": (lambda path: path.mkdir(), False, True),
    "a folder of anything": (folder_of("thesis.tex"), False, False),
    "a broken link": (lambda path: path.symlink_to(path.parent / "nowhere"), True, True),
    "a link": (lambda path: path.symlink_to(write(path.parent.parent / f"old{path.suffix}", LINE)), True, True),
}


def contents(folder):
    """All that is in it, whatever it is."""
    return {
        path: path.readlink() if path.is_symlink() else path.read_bytes() if path.is_file() else None
        for path in folder.rglob("*")
    }


@pytest.mark.parametrize("there", THERE)
def test_what_is_there_is_not_replaced_unasked(there, paths, tmp_path, capsys):
    """Nor is anything read: the input is no table."""
    paths[0].write_bytes(b"nonsense") if paths[0].suffix else paths[0].mkdir()
    THERE[there][0](paths[1])
    before = contents(tmp_path)
    assert resolve(*paths) == 2
    assert_one_line(capsys, paths[1], "is there", "--overwrite")
    assert contents(tmp_path) == before


@pytest.mark.parametrize("there", THERE)
def test_what_is_there_is_replaced_on_request_if_it_is_of_that_kind(there, paths, tmp_path, capsys):
    write(paths[0], LINE)
    make, by_a_file, by_a_folder = THERE[there]
    make(paths[1])
    before = contents(tmp_path)
    status = resolve(*paths, "--overwrite")
    if by_a_file if paths[0].suffix else by_a_folder:
        assert status == 0
        written = read(paths[1])
        assert set(written if isinstance(written, dict) else written.column_names) == {*LINE, "u1", "u2"}
        assert paths[1].is_symlink() == ("link" in there)
    else:
        assert status == 2
        assert_one_line(capsys, paths[1], "is there", "--overwrite")
        assert contents(tmp_path) == before
    assert not list(paths[1].parent.glob(".*"))


def link(path, to):
    path.symlink_to(to)
    return path


INSIDE = {
    "below": lambda source: source / "sub",
    "far below": lambda source: source / "deep" / "sub",
    "what is there": lambda source: source / "deep",
    "a column": lambda source: source / "m1.npy",
    "by a link to it": lambda source: link(source.parent / "link", source) / "sub",
    "by a link into it": lambda source: link(source.parent / "link", source / "deep") / "sub",
    "as a link into it": lambda source: link(source.parent / "link", source / "sub"),
    "by dots": lambda source: source.parent / "other" / ".." / source.name / "sub",
}


@pytest.mark.parametrize("overwrite", [[], ["--overwrite"]], ids=["new", "overwrite"])
@pytest.mark.parametrize("case", INSIDE)
def test_an_output_in_the_input(case, overwrite, tmp_path, capsys):
    source = write(tmp_path / "a", LINE)
    (source / "deep").mkdir()
    (tmp_path / "other").mkdir()
    target = INSIDE[case](source)
    before = contents(tmp_path)
    assert resolve(source, target, *overwrite) == 2
    assert_one_line(capsys, target, "lies in the input")
    assert contents(tmp_path) == before


@pytest.mark.parametrize("overwrite", [[], ["--overwrite"]], ids=["new", "overwrite"])
@pytest.mark.parametrize("how", ["below", "by a link", "by a link as a column", "by dots"])
def test_an_input_in_the_output(how, overwrite, tmp_path, capsys):
    target, source = tmp_path / "out", tmp_path / "in"
    if how == "by a link as a column":
        write(source, LINE)
        target.mkdir()
        (source / "v2.npy").rename(target / "v2.npy")
        (source / "v2.npy").symlink_to(target / "v2.npy")
    else:
        target.mkdir()
        inner = write(target / "in", LINE).rename(target / "in.npy")
        source = {"below": inner, "by a link": source, "by dots": target / ".." / "out" / "in.npy"}[how]
        if how == "by a link":
            source.symlink_to(inner)
    before = contents(tmp_path)
    assert resolve(source, target, *overwrite) == 2
    assert_one_line(capsys, target, "the input lies in it")
    assert contents(tmp_path) == before


# What appears while a run goes on


def when_all_is_written(monkeypatch, action):
    """And has not its name yet."""
    sync, done = disk.sync, list[str]()

    def syncing(*arguments):
        if not done:
            done.append(action())
        sync(*arguments)

    monkeypatch.setattr(disk, "sync", syncing)


SYSTEMS = {
    "this system": lambda monkeypatch: None,
    "no renameat2": lambda monkeypatch: monkeypatch.setattr(ctypes, "CDLL", lambda name, **options: object()),
    "no such renameat2": lambda monkeypatch: monkeypatch.setattr(renaming, "_renamed", lambda one, other, how: False),
}


@pytest.fixture(params=["this system", "no renameat2", pytest.param("no such renameat2", marks=pytest.mark.unix)])
def system(request, monkeypatch):
    """What can rename without replacing, and exchange, and what cannot."""
    SYSTEMS[request.param](monkeypatch)


@pytest.mark.parametrize("there", THERE)
def test_what_has_appeared_is_not_replaced_unasked(there, system, paths, tmp_path, monkeypatch, capsys):
    write(paths[0], LINE)
    found = []
    when_all_is_written(monkeypatch, lambda: (THERE[there][0](paths[1]), found.append(contents(tmp_path))))
    assert resolve(*paths) == 1
    assert_one_line(capsys, paths[1], "has appeared while this ran", "--overwrite")
    left = contents(tmp_path)
    assert {path: found[0][path] for path in left} == left
    assert not list(paths[1].parent.glob(".*"))


@pytest.mark.parametrize("there", ["a file", "a folder of anything"])
def test_a_folder_that_is_by_then_another_is_not_replaced(there, system, tmp_path, monkeypatch, capsys):
    source, target = write(tmp_path / "a", LINE), write(tmp_path / "b", {"old": LINE["m1"]})
    found = []

    def change():
        (target / "old.npy").unlink()
        target.rmdir()
        THERE[there][0](target)
        found.append(contents(tmp_path))

    when_all_is_written(monkeypatch, change)
    assert resolve(source, target, "--overwrite") == 1
    assert_one_line(capsys, target, "not a folder of .npy files only")
    left = contents(tmp_path)
    assert {path: found[0][path] for path in left} == left
    assert not list(tmp_path.glob(".*"))


def test_new_outputs_have_their_names_on_any_system(system, paths):
    write(paths[0], LINE)
    assert resolve(*paths) == 0
    assert list(paths[1].parent.iterdir()) == [paths[1]]
    assert len(read(paths[1])["u1"]) == N


@pytest.mark.unix
@pytest.mark.parametrize("error", [OSError(5, "Input/output error"), KeyboardInterrupt()], ids=["error", "interrupt"])
def test_a_name_that_is_taken_for_nothing_is_given_back(error, paths, monkeypatch, capsys):
    SYSTEMS["no renameat2"](monkeypatch)
    write(paths[0], LINE)

    def failing(self, target):
        assert target.exists()
        raise error

    monkeypatch.setattr(Path, "replace", failing)
    assert resolve(*paths) in (1, 130)
    assert_refused(capsys, paths[1])


def test_a_column_that_appears_in_the_old_folder_when_it_is_removed_stays_there(tmp_path, monkeypatch):
    """Who holds it open may still write to it."""
    source, target = write(tmp_path / "a", LINE), write(tmp_path / "b", {"old": LINE["m1"]})
    monkeypatch.setattr(replacement, "columns_only", lambda path: (path / "late.txt").write_text("late") == 4)
    assert resolve(source, target, "--overwrite") == 0
    (old,) = tmp_path.glob(".*")
    assert [path.name for path in old.iterdir()] == ["late.txt"]

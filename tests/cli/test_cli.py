"""`collide resolve` keeps every column, writes all or nothing, and says in one line what is wrong; `collide demo`."""

import os
import re
import shutil
import signal
import sys
import zipfile
from pathlib import Path

import numpy as np
import pytest

import collide
from collide.__main__ import UsageError, main
from collide._cli import demo
from collide._tables import by_name, stream
from collide._tables.conservation import Conservation
from tests.helpers import process, tables

N = 100
FORMS = {
    form: ({name: column[:N] for name, column in columns.items()}, function)
    for form, (columns, function) in tables.FORMS.items()
}
LINE, CARTESIAN, POLAR = (columns for columns, _ in FORMS.values())


@pytest.fixture
def source(tmp_path):
    return tmp_path / "pairs.npz"


@pytest.fixture
def target(tmp_path):
    """In a folder of its own, so that whatever is left behind there shows."""
    folder = tmp_path / "results"
    folder.mkdir()
    return folder / "after.npz"


def write(path, columns):
    """As numpy.savez, but under any names and without a word about objects."""
    with zipfile.ZipFile(path, "w") as archive:
        for name, column in columns.items():
            with archive.open(f"{name}.npy", "w") as file:
                np.lib.format.write_array(file, np.asanyarray(column))


def read(path):
    with np.load(path, allow_pickle=False) as archive:
        return {name: archive[name] for name in archive.files}


def status(*arguments):
    """The exit status, which is argparse's own way to end on some errors."""
    try:
        return main([str(argument) for argument in arguments])
    except SystemExit as end:
        return end.code


def resolve(source, target, *options):
    return status("resolve", source, "-o", target, *options)


def identical(a, b):
    return a.dtype == b.dtype and a.shape == b.shape and a.tobytes() == b.tobytes()


def assert_resolved(columns, target, expected):
    """All the input's columns, bit for bit and in order, and after them the results."""
    written = read(target)
    whole = {**{name: np.asanyarray(c) for name, c in columns.items()}, **expected._asdict()}
    assert list(written) == list(whole)
    for name, column in whole.items():
        assert identical(written[name], column), name


def assert_refused(capsys, target, *words):
    """One line that holds these words, no output, nothing left behind."""
    tables.assert_one_line(capsys, *words)
    assert list(target.parent.iterdir()) == []


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


@pytest.mark.parametrize("scalars", [("m1",), ("m1", "m2", "v1", "v2")], ids=["one", "all"])
def test_scalar_columns(scalars, source, target):
    columns = {name: column[0] if name in scalars else column for name, column in LINE.items()}
    write(source, columns)
    assert resolve(source, target) == 0
    assert_resolved(columns, target, collide.resolve_1d(**columns))


def test_float32_columns(source, target):
    columns = {name: column.astype(np.float32) for name, column in CARTESIAN.items()}
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


@pytest.mark.parametrize(("umask", "mode"), [(0o022, 0o644), (0o027, 0o640), (0o077, 0o600)])
def test_permissions_of_a_new_output_follow_the_umask(umask, mode, source, target):
    write(source, LINE)
    before = os.umask(umask)
    try:
        assert resolve(source, target) == 0
    finally:
        os.umask(before)
    assert target.stat().st_mode & 0o777 == mode


# Data at fault


def without(columns, *names):
    return {name: column for name, column in columns.items() if name not in names}


BAD_TABLES = {
    "missing column": (without(LINE, "v2"), ["v2"]),
    "missing columns": (without(CARTESIAN, "m1", "ny"), ["m1", "ny", "2d"]),
    "missing polar column": (without(POLAR, "phi", "v1"), ["phi", "v1", "polar"]),
    "two forms": (CARTESIAN | POLAR, ["2d", "polar"]),
    "two forms, one of them on a line": (CARTESIAN | LINE, ["1d", "2d"]),
    "no form": ({"x": np.arange(3.0)}, ["missing column", "m1"]),
    "no column": ({}, ["missing column", "m1"]),
    "too short": (LINE | {"v1": np.ones(98)}, ["column v1", "98", "100", "row 98"]),
    "too long": (CARTESIAN | {"ny": np.ones(103)}, ["column ny", "103", "100", "row 100"]),
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


def test_invalid_pair_is_refused_with_its_row(source, target, capsys):
    write(source, INVALID)
    assert resolve(source, target) == 1
    assert_refused(capsys, target, source, "row 42", "m2 = -1.0")


def test_several_invalid_pairs_are_counted(source, target, capsys):
    write(source, INVALID | {"v1": np.where(np.arange(100) > 97, np.nan, LINE["v1"])})
    assert resolve(source, target, "--invalid", "raise") == 1
    assert_refused(capsys, target, source, "row 42", "m2 = -1.0", "3 invalid pairs up to row 99")


def test_existing_output_survives_an_error(source, target):
    write(source, INVALID)
    target.write_text("old")
    assert resolve(source, target, "--overwrite") == 1
    assert target.read_text() == "old"
    assert list(target.parent.iterdir()) == [target]


@pytest.mark.parametrize("rule", ["keep", "nan"])
def test_invalid_pairs_are_written_on_request(rule, source, target):
    write(source, INVALID)
    assert resolve(source, target, "--invalid", rule) == 0
    assert_resolved(INVALID, target, collide.resolve_1d(**INVALID, invalid=rule))


# The command line at fault


def test_missing_input(source, target, capsys):
    assert resolve(source, target) == 2
    assert_refused(capsys, target, source)


def test_missing_output_folder(source, target, capsys):
    write(source, LINE)
    assert resolve(source, target.parent / "no" / "after.npz") == 2
    assert_refused(capsys, target, target.parent / "no")


def test_output_that_is_a_folder(source, target, capsys):
    write(source, LINE)
    assert resolve(source, target.parent) == 2
    assert_refused(capsys, target, target.parent)


def test_output_that_is_a_link_to_itself(source, target, capsys):
    write(source, LINE)
    link = source.with_name("link.npz")
    link.symlink_to(link)
    assert resolve(source, link) in (1, 2)
    assert_refused(capsys, target, link)


def link_to(source):
    link = source.with_name("link.npz")
    link.symlink_to(source)
    return link


def hard_link_to(source):
    link = source.with_name("link.npz")
    link.hardlink_to(source)
    return link


@pytest.mark.parametrize("alias", [lambda path: path, link_to, hard_link_to], ids=["same", "symlink", "hard link"])
def test_output_that_is_the_input(alias, source, target, capsys):
    write(source, LINE)
    before = source.read_bytes()
    other = alias(source)
    assert resolve(source, other) == 2
    assert_refused(capsys, target, "input")
    assert source.read_bytes() == before
    assert other.is_symlink() == (alias is link_to)


@pytest.mark.parametrize(
    "arguments",
    [
        [],
        ["collide"],
        ["resolve", "in.npz"],
        ["resolve", "-o", "out.npz"],
        ["resolve", "in.npz", "-o", "out.npz", "--fast"],
        ["resolve", "in.npz", "-o", "out.npz", "--invalid", "ignore"],
    ],
    ids=" ".join,
)
def test_wrong_usage(arguments, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    write("in.npz", LINE)
    assert status(*arguments) == 2
    assert "usage: collide" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == [tmp_path / "in.npz"]


# Interrupted


@pytest.mark.parametrize(
    ("error", "code", "words"),
    [(KeyboardInterrupt(), 130, "interrupted"), (OSError(28, "No space left"), 1, "No space left on device")],
    ids=["interrupt", "full disk"],
)
def test_old_output_survives_what_stops_the_writing(error, code, words, source, target, monkeypatch, capsys):
    write(source, LINE)
    target.write_text("old")
    seen = []
    zip_open = zipfile.ZipFile.open

    def stopping(archive, name, mode="r", **options):
        if mode == "w":
            seen.append(len(list(target.parent.iterdir())))
            if len(seen) == 3:
                raise error
        return zip_open(archive, name, mode, **options)

    monkeypatch.setattr(zipfile.ZipFile, "open", stopping)
    assert resolve(source, target, "--overwrite") == code
    (line,) = capsys.readouterr().err.splitlines()
    assert line == (f"collide: {words}" if code == 130 else f"collide: {target}: {words}")
    assert seen == [2, 2, 2]  # there was something to remove
    assert list(target.parent.iterdir()) == [target]
    assert target.read_text() == "old"


# Stops between two columns until it is told to end.
TERMINATED = """
import sys, time, zipfile
from collide.__main__ import main

zip_open = zipfile.ZipFile.open

def slow(archive, name, mode="r", **options):
    if mode == "w" and archive.filelist:
        print("writing", flush=True)
        time.sleep(60)
    return zip_open(archive, name, mode, **options)

zipfile.ZipFile.open = slow
sys.exit(main(sys.argv[1:]))
"""


def test_termination_while_writing_leaves_nothing(source, target):
    write(source, LINE)
    with process.running(sys.executable, "-c", TERMINATED, "resolve", source, "-o", target) as writing:
        assert writing.stdout.readline() == "writing\n"
        writing.terminate()
        assert writing.wait(timeout=30) == 143
    assert list(target.parent.iterdir()) == []


ENDINGS = {
    "done": (None, 0),
    "the data": (by_name.TableError("column m1"), 1),
    "the usage": (UsageError("in"), 2),
    "memory": (MemoryError(), 1),
    "the system": (OSError(28, "No space left"), 1),
    "an interrupt": (KeyboardInterrupt(), 130),
    "a termination": (signal.SIGTERM, 143),
    "a closed terminal": (signal.SIGHUP, 129),
    "a defect": (ZeroDivisionError(), None),
}


@pytest.mark.parametrize("ending", ENDINGS)
@pytest.mark.parametrize("ours", [signal.SIG_DFL, signal.SIG_IGN, lambda *_: None], ids=["default", "ignored", "own"])
def test_signal_handlers_are_put_back(ours, ending, source, target, monkeypatch):
    what, code = ENDINGS[ending]
    if isinstance(what, signal.Signals) and ours is not signal.SIG_DFL:
        code = 0  # it is the caller's

    def end(*_, **__):
        if isinstance(what, signal.Signals):
            signal.raise_signal(what)
        elif what:
            raise what
        return stream.Report(Conservation(), 0)

    write(source, LINE)
    monkeypatch.setattr(stream, "resolve", end)
    before = [signal.signal(number, ours) for number in (signal.SIGTERM, signal.SIGHUP)]
    try:
        if code is None:
            with pytest.raises(ZeroDivisionError):
                resolve(source, target)
        else:
            assert resolve(source, target) == code
        after = [signal.getsignal(number) for number in (signal.SIGTERM, signal.SIGHUP, signal.SIGINT)]
    finally:
        for number, handler in zip((signal.SIGTERM, signal.SIGHUP), before, strict=True):
            signal.signal(number, handler)
    assert after == [ours, ours, signal.getsignal(signal.SIGINT)]


# Of a process's own, at the moment in which something is imported.
INTERRUPTING = """
import os
import signal
import sys

signal.signal(signal.SIGINT, signal.default_int_handler)  # whoever runs the tests may ignore it


class Interrupting:
    def find_spec(self, name, path=None, target=None):
        if name == os.environ["INTERRUPT_AT"]:
            os.kill(os.getpid(), signal.SIGINT)


sys.meta_path.insert(0, Interrupting())
"""


def interrupted(folder, at, *command, **options):
    (folder / "sitecustomize.py").write_text(INTERRUPTING)
    path = os.pathsep.join([str(folder), str(Path(collide.__file__).parents[1])])
    return process.run(*command, env=process.environment(PYTHONPATH=path, INTERRUPT_AT=at), **options)


COMMANDS = {
    "-m": [sys.executable, "-m", "collide"],
    "-m after options": [sys.executable, "-X", "dev", "-W", "ignore", "-Bm", "collide"],
    "-mcollide": [sys.executable, "-mcollide"],
    "script": [shutil.which("collide", path=str(Path(sys.executable).parent))],
}


@pytest.mark.parametrize("command", COMMANDS)
@pytest.mark.parametrize("at", ["numpy", "llvmlite.binding", "collide.batch", "collide._tables.by_name", "pyarrow.lib"])
def test_an_interrupt_of_imports(at, command, tmp_path):
    """Whatever they make of exceptions."""
    (tmp_path / "in.csv").write_text("m1,m2,v1,v2\n1,1,1,1\n")
    arguments = ["resolve", str(tmp_path / "in.csv"), "-o", str(tmp_path / "out.csv")]
    done = interrupted(tmp_path, at, *COMMANDS[command], *arguments)
    assert (done.returncode, done.stdout, done.stderr) == (130, "", "collide: interrupted\n")
    assert not (tmp_path / "out.csv").exists()


@pytest.mark.parametrize(
    "arguments",
    [["-c", "import collide", "-m", "collide"], ["-m", "collider", "collide"], ["collide.py.txt", "collide"]],
    ids=" ".join,
)
def test_an_interrupt_of_a_librarys_imports_is_the_programs(arguments, tmp_path):
    for name in ("collider.py", "collide.py.txt"):
        (tmp_path / name).write_text("import collide")
    done = interrupted(tmp_path, "numba", sys.executable, *arguments, cwd=tmp_path)
    assert done.stderr.endswith("\nKeyboardInterrupt\n")
    assert done.returncode == -signal.SIGINT


def test_a_script_of_that_name_may_import_in_a_thread(tmp_path):
    """Which may not set handlers."""
    script = tmp_path / "collide"
    script.write_text(
        "import threading\nthread = threading.Thread(target=__import__, args=['collide'])\nthread.start()"
    )
    done = process.run(sys.executable, script)
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")


# As a command


def test_module_runs_as_a_command(source, target):
    write(source, CARTESIAN)
    done = process.run(sys.executable, "-W", "error", "-m", "collide", "resolve", source, "-o", target, "--quiet")
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
    assert_resolved(CARTESIAN, target, collide.resolve_2d(**CARTESIAN))


def test_module_reports_bad_data_in_one_line(source, target):
    write(source, without(LINE, "v2"))
    done = process.run(sys.executable, "-m", "collide", "resolve", source, "-o", target)
    assert (done.returncode, done.stdout) == (1, "")
    assert done.stderr == f"collide: {source}: missing column v2 (of the 1d form)\n"


def test_console_script(source, target):
    script = shutil.which("collide", path=str(Path(sys.executable).parent))
    assert script, "the README's command installs the package, and with it this script"
    write(source, LINE)
    assert process.run(script, "resolve", source, "-o", target).returncode == 0
    assert_resolved(LINE, target, collide.resolve_1d(**LINE))
    assert process.run(script, "resolve", source).returncode == 2


def test_help_names_every_column():
    done = process.run(sys.executable, "-m", "collide", "resolve", "--help")
    assert done.returncode == 0
    for name in {*LINE, *CARTESIAN, *POLAR, "restitution"}:
        assert re.search(rf"\b{name}\b", done.stdout), name


def test_demo_prints_speed_and_drift(capsys):
    demo.main(n=100_000, rounds=2)
    text = capsys.readouterr().out
    number = r"([\d.]+(?:e[-+]\d+)?)"
    for form in ("Cartesian", "polar"):
        rate = re.search(rf"{form} +{number} million pairs/s", text)
        assert float(rate[1]) > 0.0
    for figure in ("times as fast as the NumPy expression", "of the memory limit"):
        found = re.findall(rf"{number} {figure}", text)
        assert len(found) == 2
        assert all(float(value) > 0.0 for value in found)
    drifts = re.findall(rf"{number} relative drift of total momentum, {number} of total energy", text)
    assert len(drifts) == 2
    assert all(float(value) < 1e-13 for pair in drifts for value in pair)


@pytest.mark.parametrize(
    ("error", "words"),
    [
        (MemoryError(), "out of memory"),
        (MemoryError("Unable to allocate\n76.3 MiB"), "Unable to allocate 76.3 MiB"),
        (OSError(28, "No space left"), "No space left on device"),
        (OSError("what has no number"), "what has no number"),
    ],
    ids=str,
)
def test_demo_that_fails_says_so(error, words, monkeypatch, capsys):
    def failing():
        raise error

    monkeypatch.setattr(demo, "main", failing)
    assert status("demo") == 1
    assert capsys.readouterr().err == f"collide: demo: {words}\n"


def test_demo_without_room_for_its_output():
    """Which shows when it is flushed."""
    code = (
        "from collide import __main__; from collide._cli import demo; demo.main = lambda: print(1); "
        "raise SystemExit(__main__.main(['demo']))"
    )
    with Path("/dev/full").open("w") as full:
        done = process.python(code, stdout=full)
    assert (done.returncode, done.stderr) == (1, "collide: demo: No space left on device\n")

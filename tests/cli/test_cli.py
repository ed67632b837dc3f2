"""`collide resolve` as a command: wrong usage in one line, all or nothing when it is stopped, and its exit status."""

import os
import re
import shutil
import signal
import sys
import tomllib
import zipfile
from pathlib import Path

import numba
import numpy as np
import pytest

import collide
from collide.__main__ import _parser, main
from collide._cli.messages import UsageError
from collide._system import signals
from collide._tables import by_name, formats, stream
from collide._tables.conservation import Conservation
from tests.helpers import process
from tests.helpers.npz import LINE, POLAR, SPACE, assert_refused, assert_resolved, without, write
from tests.helpers.tables import resolve, status

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


@pytest.mark.fast
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
        for _ in range(600):  # a signal just before a sleep does not shorten it
            time.sleep(0.1)
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
    **{f"signal {number}": (signal.Signals(number), 128 + number) for number in signals.ENDS},
    "a defect": (ZeroDivisionError(), None),
}


@pytest.mark.fast
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
    monkeypatch.setattr(stream, "run", end)
    before = [signal.signal(number, ours) for number in signals.ENDS]
    try:
        if code is None:
            with pytest.raises(ZeroDivisionError):
                resolve(source, target)
        else:
            assert resolve(source, target) == code
        after = [signal.getsignal(number) for number in (*signals.ENDS, signal.SIGINT)]
    finally:
        for number, handler in zip(signals.ENDS, before, strict=True):
            signal.signal(number, handler)
    assert after == [ours, ours, signal.getsignal(signal.SIGINT)]


# As a command


def test_module_runs_as_a_command(source, target):
    write(source, SPACE)
    done = process.run(sys.executable, "-W", "error", "-m", "collide", "resolve", source, "-o", target, "--quiet")
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
    assert_resolved(SPACE, target, collide.resolve_3d(**SPACE))


@pytest.mark.fast
def test_module_reports_bad_data_in_one_line(source, target):
    write(source, without(LINE, "v2"))
    done = process.run(sys.executable, "-m", "collide", "resolve", source, "-o", target)
    assert (done.returncode, done.stdout) == (1, "")
    said = "missing column v2 (of the 1d form); there are m1, m2, v1: `columns` says which is which (--columns v2=NAME)"
    assert done.stderr == f"collide: {source}: {said}\n"


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
    for name in {*LINE, *SPACE, *POLAR, "restitution"}:
        assert re.search(rf"\b{name}\b", done.stdout), name


def test_help_lists_every_format_and_option():
    done = process.run(sys.executable, "-m", "collide", "resolve", "--help")
    assert done.returncode == 0
    for name, known in formats.FORMATS.items():
        assert re.search(rf"^  {re.escape(name)} +{re.escape(known.what)}$", done.stdout, re.MULTILINE), name
    for option in ("--output", "--overwrite", "--from", "--to", "--delimiter", "--form", "--columns", "--invalid"):
        assert re.search(rf"{option}\b", done.stdout), option
    assert "Standard output cannot: after an error," in done.stdout
    examples = re.findall(r"^  (?:.* \| )?(collide resolve .*?)(?: \| .*)?$", done.stdout, re.MULTILINE)
    assert len(examples) == 2
    for example in examples:
        assert _parser().parse_args(example.split()[1:]).run


@pytest.mark.parametrize(("command", "frozen"), [(["-m", "collide"], True), (["-c", "import collide.__main__"], False)])
def test_at_its_end_the_command_leaves_its_garbage_to_the_system(command, frozen, source, target):
    """A fifth of the time that a small file takes; a program that imports the package ends as it would."""
    write(source, LINE)
    look = "import atexit, gc\nat_first = gc.get_freeze_count()\n"  # Python 3.12 freezes what it begins with
    look += "@atexit.register\ndef look():\n    print(gc.get_freeze_count() > at_first)\n"
    (target.parent / "sitecustomize.py").write_text(look)
    path = os.pathsep.join([str(target.parent), str(Path(collide.__file__).parents[1])])
    arguments = "resolve", source, "-o", target, "--quiet"
    done = process.run(sys.executable, *command, *arguments, env=process.environment(PYTHONPATH=path))
    assert (done.returncode, done.stdout, done.stderr) == (0, f"{frozen}\n", "")


def test_version(capsys):
    with pytest.raises(SystemExit, match=r"^0$"):
        main(["--version"])
    said = capsys.readouterr().out
    assert said.startswith(
        f"collide {collide.__version__}, Numba {numba.__version__}, NumPy {np.__version__}, Python 3."
    )
    assert re.fullmatch(r"\d+\.\d+\.\d+", collide.__version__)
    project = tomllib.loads((Path(__file__).parents[2] / "pyproject.toml").read_text())
    assert project["tool"]["setuptools"]["dynamic"]["version"] == {"attr": "collide.__version__"}

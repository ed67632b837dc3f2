"""What `collide resolve` writes into files of every format, its options, and what it says of bad ones."""

import importlib.util
import os
import re
import sys
import warnings
import zipfile
from pathlib import Path

import numpy as np
import pytest

import collide
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
    few_formats,
    read,
    resolve,
    write,
)

pytestmark = pytest.mark.usefixtures("small_blocks")


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


@pytest.mark.parametrize("suffix", [".parquet", ".arrow", ".arrows", ""])
def test_float32_columns(suffix, tmp_path):
    columns = {name: column.astype(np.float32) for name, column in PLANE.items()}
    write(tmp_path / f"a{suffix}", columns)
    assert resolve(tmp_path / f"a{suffix}", tmp_path / f"b{suffix}") == 0
    for name, u in collide.resolve_2d(**columns)._asdict().items():
        np.testing.assert_array_equal(np.asarray(read(tmp_path / f"b{suffix}")[name]), u, strict=True)


def test_no_rows(paths, capsys):
    write(paths[0], {name: column[:0] for name, column in LINE.items()})
    assert resolve(*paths) == 0
    assert capsys.readouterr().out.startswith("0 pairs, ")
    written = read(paths[1])
    assert len(written["u2"]) == 0
    assert len(written) == 6 or len(written.column_names) == 6


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
    if sys.platform == "win32":
        pytest.skip("Windows has no pseudo-terminals (pty), by which the bar is shown here")
    import fcntl
    import pty
    import struct
    import termios

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


@pytest.mark.unix
@few_formats
def test_progress_on_a_terminal(paths):
    write(paths[0], LINE)
    shown = on_a_terminal(*paths)
    assert re.search(r"100%.*1\.00k/1\.00k \[.*rows/s\]", shown) or paths[0].suffix == ".arrows"
    assert re.search(r"1\.00k.* rows", shown)


@pytest.mark.unix
def test_quiet_shows_nothing_on_a_terminal(tmp_path):
    shown = on_a_terminal(write(tmp_path / "a.csv", LINE), tmp_path / "b.csv", "--quiet")
    # Where colorama is installed, Numba leaves the terminal's colours reset.
    assert shown.removesuffix("\x1b[0m") == ""


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


@pytest.mark.fast
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
    assert capsys.readouterr().out.endswith(" (10 pairs, invalid or without a finite energy, not counted)\n")


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


def test_energies_beyond_float64_do_not_stop_the_report(tmp_path, capsys):
    v = 1e153 * RNG.uniform(0.5, 1.0, N)
    source = write(tmp_path / "a", {"m1": np.ones(N), "m2": np.ones(N), "v1": v, "v2": -v})
    assert resolve(source, tmp_path / "b") == 0
    assert "(1,000 pairs, invalid or without a finite energy, not counted)" in capsys.readouterr().out


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


@pytest.mark.unix
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

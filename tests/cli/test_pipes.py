"""Standard input and output: tables that come from a pipe, and go into one."""

import io
import os
import signal
import sys
import time
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.csv
import pytest

import collide
from collide._tables import standard
from tests.helpers import any_format, process
from tests.helpers.tables import LINE, PLANE, N, assert_one_line, resolve, status, write

RESOLVE = sys.executable, "-m", "collide", "resolve"
STREAMS = {"csv": ".csv", "tsv": ".tsv", "arrows": ".arrows"}


@pytest.fixture
def piped(tmp_path, monkeypatch, capfdbinary):
    """Runs the command line in this process with a file as its standard input; its status, output and errors."""

    def run(source, *options):
        with source.open("rb") as file:
            monkeypatch.setattr(sys, "stdin", file)
            code = status("resolve", "-", *options)
        sys.stdout.flush()
        return code, *capfdbinary.readouterr()

    return run


@pytest.mark.parametrize("to", STREAMS)
@pytest.mark.parametrize("from_", STREAMS)
@pytest.mark.usefixtures("small_blocks")
def test_what_goes_through_pipes_is_what_goes_through_files(from_, to, tmp_path, piped):
    source = any_format.write(tmp_path / f"a{STREAMS[from_]}", PLANE)
    assert resolve(source, tmp_path / f"b{STREAMS[to]}", "--quiet") == 0
    code, out, err = piped(source, "--from", from_, "-o", "-", "--to", to)
    assert code == 0
    assert out == (tmp_path / f"b{STREAMS[to]}").read_bytes()
    assert err.startswith(b"1,000 pairs, 0 of them invalid; relative change of total momentum ")
    (tmp_path / f"c{STREAMS[to]}").write_bytes(out)
    written = any_format.read(tmp_path / f"c{STREAMS[to]}")
    for name, u in collide.resolve_2d(**PLANE)._asdict().items():
        np.testing.assert_array_equal(written[name].astype(float), u)


@pytest.mark.parametrize("n", [0, 1, N])
@pytest.mark.parametrize("from_", STREAMS)
def test_output_is_as_the_input_unless_said(from_, n, tmp_path, piped):
    source = any_format.write(tmp_path / f"a{STREAMS[from_]}", {name: column[:n] for name, column in LINE.items()})
    assert resolve(source, tmp_path / f"b{STREAMS[from_]}", "--quiet") == 0
    assert piped(source, "--from", from_, "-o", "-", "--quiet") == (
        0,
        (tmp_path / f"b{STREAMS[from_]}").read_bytes(),
        b"",
    )


@pytest.mark.parametrize("target", ["b.parquet", "b.npz", "b", "b.csv.gz", "b.arrow"])
def test_from_a_pipe_into_a_file(target, tmp_path, piped):
    source = any_format.write(tmp_path / "a.csv", LINE)
    code, out, err = piped(source, "--from", "csv", "-o", tmp_path / target)
    assert (code, err) == (0, b"")
    assert out.startswith(b"1,000 pairs, ")
    np.testing.assert_array_equal(any_format.read(tmp_path / target)["u1"].astype(float), collide.resolve_1d(**LINE).u1)


def test_from_a_file_into_a_pipe(tmp_path, capfdbinary):
    source = any_format.write(tmp_path / "a.npz", LINE)
    assert resolve(source, "-", "--to", "csv", "--delimiter", ";") == 0
    sys.stdout.flush()
    out, err = capfdbinary.readouterr()
    assert out.startswith(b"m1;m2;v1;v2;u1;u2\n")
    assert len(out.splitlines()) == N + 1
    assert err.startswith(b"1,000 pairs, ")


def test_text_whose_names_do_not_end(tmp_path, piped):
    (tmp_path / "a.csv").write_bytes(b"m1,m2,v1,v2")
    assert piped(tmp_path / "a.csv", "--from", "csv", "-o", "-", "--quiet") == (0, b"m1,m2,v1,v2,u1,u2\n", b"")


@pytest.mark.usefixtures("small_blocks")
@pytest.mark.parametrize("row", [0, 17, N - 1])
def test_faults_in_a_pipe_are_named_by_their_rows(row, tmp_path, piped):
    v1 = [*map(repr, LINE["v1"].tolist())]
    v1[row] = "fast"
    source = write(tmp_path / "a.csv", {**LINE, "v1": v1})
    code, _, err = piped(source, "--from", "csv", "-o", "-")
    assert (code, err) == (1, f"collide: standard input: column v1: row {row}: 'fast' is no number\n".encode())
    code, _, err = piped(source, "--from", "csv", "-o", tmp_path / "out" / "b.csv")
    assert (code, err) == (2, f"collide: {tmp_path / 'out'}: no such folder: it has to be made before\n".encode())


@pytest.mark.usefixtures("small_blocks")
@pytest.mark.parametrize("from_", ["csv", "arrows"])
@pytest.mark.parametrize("content", [b"", b"nonsense", bytes(100), b"\xff" * 50, b"m1,m2\n1,2,3\n"])
def test_what_is_no_table_in_a_pipe(content, from_, tmp_path, piped):
    (tmp_path / "a").write_bytes(content)
    code, out, err = piped(tmp_path / "a", "--from", from_, "-o", "-")
    assert (code, out) == (1, b"")
    assert err.startswith(b"collide: standard input: ")
    assert len(err.splitlines()) == 1


@pytest.mark.parametrize("part", [0.3, 0.9])
def test_a_stream_of_arrow_that_is_cut_off(part, tmp_path, piped):
    source = write(tmp_path / "a.arrows", LINE)
    source.write_bytes(source.read_bytes()[: int(part * source.stat().st_size)])
    code, _, err = piped(source, "--from", "arrows", "-o", "-")
    assert code == 1
    assert err.startswith(b"collide: standard input: row 0: cannot be read (")


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["-", "-o", "b.csv"], "standard input: --from must say what comes: one of arrows, csv, tsv"),
        (["-", "-o", "b.csv", "--from", "parquet"], "standard input: --from must say what comes"),
        (["a.npz", "-o", "-"], "standard output: --to must say what is wanted: one of arrows, csv, tsv"),
        (["a.npz", "-o", "-", "--to", "npz"], "standard output: --to must say what is wanted"),
    ],
)
def test_pipes_without_a_format(arguments, words, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    any_format.write(tmp_path / "a.npz", LINE)
    assert status("resolve", *arguments) == 2
    assert_one_line(capsys, words)


@pytest.mark.parametrize(("closed", "words"), [("stdin", "input"), ("stdout", "output")])
def test_pipes_that_are_closed(closed, words, monkeypatch, capsys):
    monkeypatch.setattr(sys, closed, None)
    code = status("resolve", "-", "--from", "csv", "-o", "-")
    monkeypatch.undo()
    assert code == 2
    assert f"standard {words}: is closed" in capsys.readouterr().err


def test_a_file_called_as_standard_input(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    any_format.write(tmp_path / "a.csv", LINE).rename(tmp_path / "-")
    assert status("resolve", "./-", "--from", "csv", "-o", "b.npz") == 0
    assert status("resolve", "b.npz", "-o", "./-", "--to", "csv", "--columns", "u1=w1,u2=w2", "--overwrite") == 0
    assert Path("-").read_text().startswith("m1,m2,v1,v2,u1,u2,w1,w2\n")
    Path("-").write_text("m1\n")
    assert status("resolve", "./-", "--from", "csv", "-o", "c.npz") == 1
    assert capsys.readouterr().err.startswith("collide: -: missing column m2, v1, v2 ")


# As a command


@pytest.mark.parametrize("to", ["csv", "arrows"])
def test_a_reader_that_has_had_enough(to, tmp_path):
    """As head: nothing is said, and the status is that of a command that SIGPIPE ends."""
    source = any_format.write(tmp_path / "a.csv", {name: np.resize(column, 200_000) for name, column in LINE.items()})
    with process.running(*RESOLVE, source, "-o", "-", "--to", to, stderr=process.PIPE, text=False) as writing:
        assert writing.stdout.read(4) in (b"m1,m", b"\xff\xff\xff\xff")
        writing.stdout.close()
        assert writing.wait(timeout=60) == 141
        assert writing.stderr.read() == b""


@pytest.mark.parametrize("unbuffered", [None, "1"])
def test_a_reader_that_is_gone_before_little_is_written(unbuffered, tmp_path):
    """Which shows at the end, and must not once more when Python ends."""
    source = any_format.write(tmp_path / "a.csv", {name: column[:3] for name, column in LINE.items()})
    options = {"env": process.environment(PYTHONUNBUFFERED=unbuffered), "stderr": process.PIPE, "text": False}
    with process.running(*RESOLVE, source, "-o", "-", **options) as writing:
        writing.stdout.close()
        assert writing.wait(timeout=60) == 141
        assert writing.stderr.read() == b""


@pytest.mark.parametrize("to", STREAMS)
def test_standard_output_that_takes_a_few_bytes_at_once(to, tmp_path, monkeypatch):
    """As a file may that Python does not buffer."""
    taken = []

    class Slow(io.RawIOBase):
        def writable(self):
            return True

        def write(self, data):
            taken.append(bytes(data[:99]))
            return len(taken[-1])

    source = any_format.write(tmp_path / "a.tsv", LINE)
    assert resolve(source, tmp_path / f"b{STREAMS[to]}", "--quiet") == 0
    monkeypatch.setattr(sys, "stdout", io.TextIOWrapper(Slow()))  # type: ignore[type-var]
    assert resolve(source, "-", "--to", to, "--quiet") == 0
    assert b"".join(taken) == (tmp_path / f"b{STREAMS[to]}").read_bytes()


@pytest.mark.unix
def test_standard_output_that_is_full(tmp_path):
    source = any_format.write(tmp_path / "a.csv", LINE)
    with Path("/dev/full").open("w") as full:
        done = process.run(*RESOLVE, source, "-o", "-", stdout=full)
    assert (done.returncode, done.stderr) == (1, "collide: standard output: No space left on device\n")


@pytest.mark.unix
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize("begin", [b"", b"m1,m2,v1,v2\n1,1,3,0\n", b"m1,m2,v1,v2\n" + b"1,1,3,0\n" * 2_000_000])
def test_what_waits_for_its_input_can_be_stopped(begin, number, tmp_path):
    """Whether nothing has come, little, or all that is read ahead."""
    target = tmp_path / "b.csv"
    command = *RESOLVE, "-", "--from", "csv", "-o", target
    with process.running(*command, stdin=process.PIPE, stderr=process.PIPE, text=False) as waiting:
        waiting.stdin.write(begin)
        waiting.stdin.flush()
        time.sleep(1.5)  # in which it has come to wait
        waiting.send_signal(number)
        assert waiting.wait(timeout=30) == 128 + number
        assert waiting.stderr.read() == (b"collide: interrupted\n" if number == signal.SIGINT else b"")
    assert list(tmp_path.iterdir()) == []


def test_a_fault_is_said_while_the_pipe_is_open(tmp_path):
    """Who writes into it may wait for ever."""
    command = *RESOLVE, "-", "--from", "csv", "-o", tmp_path / "b.csv"
    with process.running(*command, stdin=process.PIPE, stderr=process.PIPE, text=False) as waiting:
        waiting.stdin.write(b"m1,m2,v1,v2\n" + b"-1,1,3,0\n" * 2_000_000)
        waiting.stdin.flush()
        assert waiting.wait(timeout=60) == 1
        assert waiting.stderr.read().startswith(b"collide: standard input: row 0: m1 = -1.0: ")
    assert list(tmp_path.iterdir()) == []


# Standard input


@pytest.fixture
def pipe(monkeypatch):
    """Standard input, and what writes into it."""
    ours, theirs = os.pipe()
    with os.fdopen(ours, "rb") as file, os.fdopen(theirs, "wb", 0) as writer:
        monkeypatch.setattr(sys, "stdin", file)
        yield standard.Input(), writer


def test_reads_are_whole_however_the_bytes_come(pipe):
    reader, writer = pipe
    for piece in (b"ab", b"cde", b"f"):
        writer.write(piece)
    assert reader.peek(4) == b"abcd"
    assert reader.read(5) == b"abcde"
    assert reader.tell() == 5
    writer.close()
    assert reader.read(5) == b"f"
    assert reader.read(5) == b""


def test_who_waits_learns_that_no_more_is_wanted(pipe):
    reader, writer = pipe
    writer.write(b"ab")
    assert reader.read(1) == b"a"
    reader.close()
    reader.close()
    assert reader.read(5) == b"b"


def test_an_error_of_the_system_comes_to_the_reader(monkeypatch, pipe):
    def failing(handle, n_bytes):
        raise OSError(5, "Input/output error")

    monkeypatch.setattr(os, "read", failing)
    with pytest.raises(OSError, match="Input/output error"):
        standard.Input().read(5)


def test_pyarrow_reads_from_it(pipe):
    reader, writer = pipe
    writer.write(any_format.as_text({name: column[:100] for name, column in LINE.items()}))
    writer.close()
    assert pa.csv.read_csv(pa.PythonFile(reader, "r")).num_rows == 100


def test_the_input_is_no_output(tmp_path):
    source = any_format.write(tmp_path / "a.csv", LINE)
    before = source.read_bytes()
    with source.open("ab") as file:
        done = process.run(sys.executable, "-m", "collide", "resolve", source, "-o", "-", stdout=file)
    assert done.returncode == 2
    assert "standard output: is the input" in done.stderr
    assert source.read_bytes() == before

"""`collide bench`: pytest on the benchmarks where they are, and one line where they are not."""

import subprocess
import sys
from pathlib import Path

import pytest

import collide
from collide._cli import bench
from tests.helpers.tables import assert_one_line, status


@pytest.fixture
def suite(tmp_path, monkeypatch):
    """Of one measurement that passes, one that fails and a guard."""
    folder = tmp_path / "benchmarks"
    (folder / "guards").mkdir(parents=True)
    (folder / "conftest.py").write_text("")
    (folder / "test_speed.py").write_text("def test_fast(): pass\ndef test_slow(): assert False\n")
    (folder / "guards" / "test_bound.py").write_text("def test_bound(): assert False\n")
    (tmp_path / "pytest.ini").write_text("[pytest]\n")
    monkeypatch.setattr(bench, "SUITE", folder)
    monkeypatch.chdir(tmp_path)
    return folder


@pytest.mark.parametrize(
    ("arguments", "code", "summary"),
    [
        (("-k", "fast"), 0, "1 passed, 1 deselected"),
        ((), 1, "1 failed, 1 passed"),
        (("--co",), 0, "2 tests collected"),
        (("-k", "bound"), 5, "2 deselected"),  # the guard is not among them
        (("--no-such",), 4, ""),
    ],
)
def test_pytest_gets_the_arguments_and_gives_the_exit_status(arguments, code, summary, suite, capfd):
    assert status("bench", *arguments, "-p", "no:cacheprovider") == code
    assert summary in capfd.readouterr().out


def test_a_termination_ends_pytest_too(suite, monkeypatch):
    ended: list[subprocess.Popen[bytes]] = []

    class Running(subprocess.Popen[bytes]):
        def wait(self, timeout=None):
            if not ended:
                ended.append(self)
                raise SystemExit(143)  # as the handler of a termination does
            return super().wait(timeout)

    monkeypatch.setattr(subprocess, "Popen", Running)
    (suite / "test_speed.py").write_text("import time\ndef test_long(): time.sleep(600)\n")
    assert status("bench") == 143
    assert ended[0].returncode not in (None, 0)


def test_an_interrupt_leaves_pytest_the_time_to_sum_up(suite, monkeypatch, capfd):
    class Running(subprocess.Popen[bytes]):
        is_interrupted = False

        def wait(self, timeout=None):
            if not self.is_interrupted:
                self.is_interrupted = True
                raise KeyboardInterrupt
            return super().wait(timeout)

    monkeypatch.setattr(subprocess, "Popen", Running)
    assert status("bench", "-k", "fast") == 0
    assert "1 passed" in capfd.readouterr().out


@pytest.mark.fast
def test_without_a_suite_it_is_said_where_it_is(suite, monkeypatch, capsys):
    monkeypatch.setattr(bench, "SUITE", suite / "none")
    assert status("bench", "-k", "fast") == 2
    assert_one_line(capsys, "source distribution", 'pip install -e ".[bench]" && python -m pytest benchmarks')


@pytest.mark.fast
def test_without_pytest_benchmark_it_is_said_how_to_get_it(suite, monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, "pytest_benchmark", None)
    assert status("bench") == 2
    assert_one_line(capsys, "needs pytest-benchmark: pip install")


@pytest.mark.fast
def test_the_sources_have_the_suite():
    project = Path(__file__).parents[2]
    assert (bench.SUITE / "conftest.py").is_file() == (Path(collide.__file__).parents[1] == project)
    assert (project / "benchmarks" / "conftest.py").is_file()

"""What Windows and macOS lack is not missed: tests, run without it (tests/helpers/elsewhere.py says what it is).

On this system there are the runs; in them, besides, what is promised on one of the others only.
"""

import _thread
import os
import sys
import threading
from pathlib import Path

import numpy as np
import pytest

import collide
from collide._system import disk, memory, processors, renaming
from tests.helpers import elsewhere, process
from tests.helpers.tables import LINE, assert_one_line, read, resolve, write

RUNS = {
    "calls": "-m fast tests/pairs/test_arguments.py tests/pairs/test_fresh.py tests/pairs/test_invalid.py "
    "tests/pairs/test_out.py tests/contacts tests/formulas/test_scalar.py tests/compile tests/system",
    "files": "-k not(stopped) tests/tables/test_files.py tests/tables/test_folders.py tests/tables/test_npz.py "
    "tests/tables/test_output.py tests/cli/test_cli.py tests/cli/test_help.py tests/cli/test_bench.py",
    "formats": "tests/tables/test_formats.py tests/tables/test_csv.py tests/tables/test_messages.py "
    "tests/cli/test_pipes.py",
}

if elsewhere.SYSTEM is None:

    @pytest.mark.parametrize("system", elsewhere.SYSTEMS)
    @pytest.mark.parametrize("run", RUNS)
    def test_on_another_system(run, system, tmp_path):
        plugins = "-p", "tests.helpers.elsewhere", "-p", "no:cacheprovider"
        command = sys.executable, "-m", "pytest", "-q", *plugins, "--basetemp", tmp_path / "tests", *RUNS[run].split()
        variables = process.environment(COLLIDE_TESTS_SYSTEM=system)
        done = process.run(*command, cwd=Path(__file__).parents[2], env=variables, timeout=300)
        assert done.returncode == 0, done.stdout + done.stderr

else:
    pytestmark = pytest.mark.fast

    def test_the_machine_is_asked_as_it_wants_to_be():
        assert memory.installed() == elsewhere.TOTAL
        assert abs(memory.free() - elsewhere.FREE) < elsewhere.TOTAL / 100
        assert processors.available() == os.cpu_count()

    def test_interrupted_calls_leave_the_library_usable(keep_threads):
        collide.set_num_threads(2)
        a, u = np.ones(200_000), (np.empty(200_000), np.empty(200_000))
        for k in range(20):
            timer = threading.Timer(k * 2e-4, _thread.interrupt_main)
            with pytest.raises(KeyboardInterrupt):
                timer.start()
                while True:
                    collide.resolve_1d(a, a, 3.0, 5.0, out=u)
            timer.join()
        assert collide.resolve_1d(a, a, 3.0, 5.0, out=u) is not None
        assert (set(u[0]), set(u[1])) == ({5.0}, {3.0})


if elsewhere.SYSTEM == "macos":

    def test_folders_are_exchanged_in_one_step(tmp_path, monkeypatch):
        one, other = write(tmp_path / "one", LINE), write(tmp_path / "other", {"old": LINE["m1"]})
        monkeypatch.setattr(Path, "rename", None)
        renaming.exchange(one, other)
        assert (set(read(one)), set(read(other))) == ({"old"}, set(LINE))

    def test_the_last_sync_is_of_the_drive_too(tmp_path, monkeypatch):
        said = []
        monkeypatch.setattr("fcntl.fcntl", lambda handle, command: said.append(command))
        monkeypatch.setattr(os, "fsync", lambda handle: said.append("fsync"))
        for last in (False, True):
            disk.sync(tmp_path, last)
        assert said == ["fsync", sys.modules["fcntl"].F_FULLFSYNC]

    @pytest.mark.parametrize(("number", "is_said"), [(45, False), (22, False), (25, False), (5, True)])
    def test_a_drive_that_cannot(number, is_said, tmp_path, monkeypatch):
        """ENOTSUP, which is another number there, EINVAL and ENOTTY, but not an error of the disk."""

        def fail(handle, command):
            raise OSError(number, "what is wrong")

        monkeypatch.setattr("errno.ENOTSUP", 45)
        monkeypatch.setattr("fcntl.fcntl", fail)
        if is_said:
            with pytest.raises(OSError, match="what is wrong"):
                disk.sync(tmp_path, True)
        else:
            disk.sync(tmp_path, True)


if elsewhere.SYSTEM == "windows":

    @pytest.mark.parametrize("suffix", [".parquet", ".arrow", ".csv", ""])
    def test_an_output_that_is_open_stays_and_it_is_said(suffix, tmp_path, capsys):
        source, target = write(tmp_path / f"a{suffix}", LINE), write(tmp_path / f"b{suffix}", {"old": LINE["m1"]})
        with (target if suffix else target / "old.npy").open("rb"):
            assert resolve(source, target, "--overwrite") == 1
        assert_one_line(capsys, target, "the system's words for 32")
        assert sorted(tmp_path.iterdir()) == [source, target]
        assert len(read(target)["old"]) == len(LINE["m1"])
        assert resolve(source, target, "--overwrite") == 0

    def test_an_output_that_may_only_be_read_stays_and_it_is_said(tmp_path, capsys):
        source, target = write(tmp_path / "a.csv", LINE), write(tmp_path / "b.csv", {"old": LINE["m1"]})
        target.chmod(0o444)
        assert resolve(source, target, "--overwrite") == 1
        assert_one_line(capsys, target, "the system's words for 5")
        assert sorted(tmp_path.iterdir()) == [source, target]

    def test_a_folder_is_not_shut_to_others_for_good(tmp_path):
        assert resolve(write(tmp_path / "a", LINE), tmp_path / "b") == 0
        assert (tmp_path / "b").stat().st_mode == (tmp_path / "a").stat().st_mode

    @pytest.mark.parametrize("name", ["aux", "Con", "lpt1", "m1:u1", "a\\b", "what?"])
    def test_devices_and_parts_of_files_are_no_columns(name, tmp_path, capsys):
        source = write(tmp_path / "a", LINE)
        assert resolve(source, tmp_path / "b", "--columns", f"u1={name}") == 1
        assert_one_line(capsys, f"column {name}: cannot be the name of a file")
        assert list(tmp_path.iterdir()) == [source]

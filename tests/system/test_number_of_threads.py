"""How many threads there are: as many as were set, or as the environment, the affinity mask or the quota say."""

import numpy as np
import pytest

import collide
from collide._system import processors
from tests.helpers import process

pytestmark = pytest.mark.usefixtures("keep_threads")


def python(code, threads=None):
    """A process for which COLLIDE_NUM_THREADS is `threads`."""
    return process.python(code, env=process.environment(COLLIDE_NUM_THREADS=threads))


@pytest.mark.fast
@pytest.mark.parametrize("n", [1, 2, 1000, np.int8(3), np.uint64(4)])
def test_number_of_threads_is_what_was_set(n):
    collide.set_num_threads(n)
    assert collide.get_num_threads() == n
    assert type(collide.get_num_threads()) is int


@pytest.mark.parametrize("n", [2.0, "2", None, True, np.True_, np.float64(2.0), [2]])
def test_number_of_threads_must_be_an_integer(n):
    before = collide.get_num_threads()
    with pytest.raises(TypeError, match="the number of threads must be an integer"):
        collide.set_num_threads(n)
    assert collide.get_num_threads() == before


@pytest.mark.parametrize("n", [0, -1, np.int64(-5)])
def test_number_of_threads_must_be_positive(n):
    before = collide.get_num_threads()
    with pytest.raises(ValueError, match=f"n = {n}: the number of threads must be at least 1"):
        collide.set_num_threads(n)
    assert collide.get_num_threads() == before


SHOW = "import collide; print(collide.get_num_threads())"


@pytest.mark.parametrize("threads", ["1", "7", "064"])
def test_environment_variable_sets_the_number_of_threads(threads):
    done = python(SHOW, threads=threads)
    assert done.stdout == f"{int(threads)}\n", done.stderr


@pytest.mark.parametrize("threads", ["0", "-1", "2.5", "two", "²", "1_0"])
def test_environment_variable_is_checked(threads):
    done = python(SHOW, threads=threads)
    assert done.returncode == 1
    last = done.stderr.splitlines()[-1]
    assert last.startswith("ValueError: ")
    assert "COLLIDE_NUM_THREADS" in last
    assert repr(threads) in last


def test_wrong_environment_variable_stops_a_batch_and_not_the_import():
    code = "import numpy as np, collide; print('imported'); a = np.ones(100_000); collide.resolve_1d(a, a, a, a)"
    done = python(code, threads="many")
    assert (done.returncode, done.stdout) == (1, "imported\n")
    assert "COLLIDE_NUM_THREADS = 'many'" in done.stderr.splitlines()[-1]


def test_setting_the_number_overrules_the_environment_variable():
    done = python("import collide; collide.set_num_threads(3); print(collide.get_num_threads())", threads="many")
    assert done.stdout == "3\n", done.stderr


def test_default_number_of_threads_keeps_to_the_affinity_mask():
    code = f"import os; os.sched_setaffinity(0, [min(os.sched_getaffinity(0))]); {SHOW}"
    assert python(code).stdout == "1\n"


@pytest.mark.fast
@pytest.mark.parametrize(
    ("files", "quota"),
    [
        ({}, None),
        ({"cpu.max": "max 100000\n"}, None),
        ({"cpu.max": "100000 100000\n"}, 1),
        ({"cpu.max": "250000 100000\n"}, 3),
        ({"cpu.max": "1000 100000\n"}, 1),
        ({"cpu/cpu.cfs_quota_us": "-1\n", "cpu/cpu.cfs_period_us": "100000\n"}, None),
        ({"cpu/cpu.cfs_quota_us": "150000\n", "cpu/cpu.cfs_period_us": "100000\n"}, 2),
    ],
)
def test_default_number_of_threads_keeps_to_the_quota(files, quota, tmp_path, monkeypatch):
    for name, text in files.items():
        path = tmp_path / "sys/fs/cgroup" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    monkeypatch.setattr(processors, "Path", lambda name: tmp_path / name.lstrip("/"))
    monkeypatch.setattr(processors, "_usable", lambda: 64)  # which asks otherwise since Python 3.13
    assert processors.available() == (64 if quota is None else quota)

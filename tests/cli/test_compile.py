"""`collide compile`: nothing is left to compile, whatever is called; where nothing can be kept, it says so at once."""

import ast
import re
import shutil
import sys

import pytest
from numba import types
from numba.core import config

from collide._cli import kernels
from collide._compile import cache
from collide._compile.kernel import Kernel
from tests.helpers import process
from tests.helpers.tables import assert_one_line, status

# Every public function, and one file, with what has a kernel of its own: dtypes, layouts, sizes, threads.
EVERYTHING = """
import itertools, sys
import numpy as np
import collide
from collide import __main__, arrow, dask
from collide._compile import kernel
from collide._pairs.forms import COLLISIONS

collide.set_num_threads(2)
rng = np.random.default_rng(0)
n, n_few = 400_000, 500


def numbers(*shape, least=0.5, most=2.0, dtype="d"):
    return rng.uniform(least, most, shape).astype(dtype)


called = {name for name in collide.__all__ if not callable(getattr(collide, name)) or name.startswith("set_")}
called |= {"InvalidPairError", "get_num_threads", "get_spare_memory"}
arguments = {
    "resolve_1d": 4, "resolve_2d": 8, "resolve_3d": 11, "resolve_polar": 7, "impulse_2d": 8, "impulse_3d": 11,
    "time_of_impact": 5, "time_of_impact_3d": 7,
}
for name, dtype in itertools.product(arguments, "df"):
    columns = [numbers(n, dtype=dtype) for _ in range(arguments[name])]
    getattr(collide, name)(*columns)
    getattr(collide, name)(*columns[:-1], np.float64(1.0))  # the result is float64
    called.add(name)
m = numbers(n)
for d, dtype in itertools.product((2, 3), "df"):
    v, normal = (numbers(n, d, dtype=dtype) for _ in range(2))
    collide.resolve(m, m, v, v, normal)
    i, j = np.arange(0, n, 2), np.arange(1, n, 2)
    collide.resolve_pairs(i, j, m, v, np.ascontiguousarray(normal[: n // 2]))
    collide.resolve_pairs(i, j, m, tuple(v.T.copy()), tuple(normal[: n // 2].T.copy()), impulse=np.zeros(n // 2))
called |= {"resolve", "resolve_pairs"}
for some, mixed, box in itertools.product((n_few, n), (False, True), (None, (1000.0, 1000.0))):
    x, y = numbers(2, some, least=0.0, most=1000.0)
    radius = numbers(some) if mixed else 0.5
    i, j = collide.find_contacts(x, y, radius, box=box, margin=0.1)
    for dtype, gaps in itertools.product("df", (False, True)):
        vx, vy = numbers(some, 2, dtype=dtype).T if gaps else numbers(2, some, dtype=dtype)
        for size in (None, radius):
            collide.resolve_contacts(i, j, m[:some], x, y, vx, vy, radius=size, box=box)
        for place in "df":
            at = [a.astype(place) for a in (x, y)]
            collide.resolve_walls(*at, vx, vy, radius if place == "d" else 0.5, (1000.0, 1000.0))
x, y = numbers(2, n, least=0.0, most=1000.0)
collide.find_contacts(x, y, np.where(np.arange(n) % 1000, 0.5, 1e-4))  # a few small ones far apart
called |= {"find_contacts", "resolve_contacts", "resolve_walls"}
assert called == set(collide.__all__), set(collide.__all__) - called
for name, form in COLLISIONS.items():
    np.savez(f"{name}.npz", **{column: numbers(100) for column in form.columns[:-1]})
    assert __main__.main(["resolve", f"{name}.npz", "-o", f"{name}-after.npz", "--quiet"]) == 0
print([one.name for one in kernel.KERNELS if "compiled" not in vars(one)])
"""


def kept_in(folder):
    return {path.name: path.stat().st_mtime_ns for path in (folder / "collide").iterdir()}


def run(folder, *command):
    variables = process.environment(NUMBA_CACHE_DIR=folder)
    return process.run(sys.executable, *command, env=variables, cwd=folder, timeout=600)


def said(done):
    assert (done.returncode, done.stderr) == (0, "")
    return re.fullmatch(r"(\d+) kernels, (\d+) of them compiled in \d+ s, are kept in (.*)\n", done.stdout).groups()


@pytest.fixture(scope="module")
def filled(tmp_path_factory):
    """A folder in which are the kernels that the command makes or finds in the tests' own, and no others."""
    code = (
        "from collide import __main__; __main__.main(['compile']); from collide._compile.kernel import KERNELS; "
        "print([str(one.cache.path) for one in KERNELS])"
    )
    folder = tmp_path_factory.mktemp("filled")
    (folder / "collide").mkdir()
    paths = ast.literal_eval(process.printed_by(code, timeout=600).splitlines()[-1])
    for path in paths:
        shutil.copy(path, folder / "collide")
    assert len(kept_in(folder)) == len(paths)
    return folder


def test_afterwards_nothing_is_compiled(filled):
    before = kept_in(filled)
    done = run(filled, "-c", EVERYTHING)
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout == "[]\n"  # all that there are have been called
    assert kept_in(filled) == before


def test_a_second_run_compiles_nothing(filled):
    before = kept_in(filled)
    count, compiled, place = said(run(filled, "-m", "collide", "compile"))
    assert (int(count), compiled, place) == (len(before), "0", str(filled / "collide"))
    assert kept_in(filled) == before


# Kernels that take no time to compile


def add(x, y):
    return x + y


@pytest.fixture
def two_kernels(tmp_path, monkeypatch):
    monkeypatch.setattr(config, "CACHE_DIR", str(tmp_path / "kernels"))
    signature = types.int64(types.int64, types.int64)
    two = [Kernel(add, signature, name) for name in ("add", "add_again")]
    monkeypatch.setattr(kernels, "KERNELS", two)
    return two


@pytest.mark.fast
def test_what_it_says(two_kernels, tmp_path, capsys):
    assert status("compile") == 0
    folder = tmp_path / "kernels" / "collide"
    words = f"2 kernels, 2 of them compiled in 0 s, are kept in {folder}\n"
    assert capsys.readouterr() == (words, "")
    assert {one.cache.path for one in two_kernels} == set(folder.iterdir())


@pytest.mark.fast
@pytest.mark.parametrize("is_there", [True, False], ids=["no room", "no folder"])
def test_where_nothing_can_be_kept_it_ends_at_the_first(is_there, two_kernels, tmp_path, monkeypatch, capsys):
    def fail(*_):
        raise OSError(28, "No space left")

    if is_there:
        monkeypatch.setattr(cache, "_write", fail)
    else:
        (tmp_path / "kernels").write_text("a file, and no folder")
    assert status("compile") == 1
    assert_one_line(capsys, "compile: kernels cannot be kept in", tmp_path / "kernels" / "collide", "NUMBA_CACHE_DIR")
    assert "compiled" not in vars(two_kernels[1])


@pytest.mark.parametrize("command", ["compile", "demo"])
def test_without_the_compiler_it_is_one_line(command):
    done = process.run(sys.executable, "-m", "collide", command, env=process.environment(NUMBA_DISABLE_JIT=1))
    assert done.returncode == 1
    assert re.fullmatch("collide: .*NUMBA_DISABLE_JIT is set.*\n", done.stderr)

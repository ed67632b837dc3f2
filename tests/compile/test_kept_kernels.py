"""What processes find on disk that import a copy of the package: kernels are kept, never stale, and not needed."""

import os
import shutil
import sys
from contextlib import ExitStack
from pathlib import Path

import pytest

import collide
from tests.helpers import process
from tests.helpers.sizes import sizes

# The mark tells the answers of the formula and of its edit apart.
SHOW = "print('u1 =', collide.resolve_1d([1.0], [3.0], [4.0], [0.0]).u1[0])"
CALL = f"import collide; {SHOW}"
ANSWER = "u1 = -2.0\n"
FORMULA, EDITED_FORMULA = "each(fused, -j1, n, v1)", "each(fused, j1, n, v1)"
EDITED_ANSWER = "u1 = 10.0\n"


@pytest.fixture
def folder(tmp_path):
    """A copy of the package, without anything compiled."""
    return copy_package(tmp_path / "site")


def copy_package(folder):
    ignored = shutil.ignore_patterns("__pycache__")
    shutil.copytree(Path(collide.__file__).parent, folder / "collide", ignore=ignored)
    return folder


def environment(folder, **variables):
    """Of a process that imports the copy, and keeps kernels where the variables say, else in the folder itself."""
    none = {name: None for name in os.environ if name.startswith(("NUMBA_", "XDG_", "COLLIDE_"))}
    return process.environment(**{**none, "PYTHONPATH": folder, "HOME": folder / "home", **variables})


def answer(folder, code=CALL, **variables):
    return process.printed_by(code, cwd=folder, env=environment(folder, **variables))


def kernels(folder):
    """When which file was written."""
    return {path: path.stat().st_mtime_ns for path in folder.rglob("*.nbc")}


def edit(folder, old, new):
    path = folder / "collide" / "_formulas" / "collision.py"
    text = path.read_text()
    assert text.count(old) == 1
    before = path.stat().st_mtime
    path.write_text(text.replace(old, new))
    # Python itself misses an edit that leaves both the length and the second as they were.
    os.utime(path, (before + 10, before + 10))


@pytest.fixture(scope="module")
def filled(tmp_path_factory):
    """A copy of the package whose kernel is in NUMBA_CACHE_DIR = kernels."""
    folder = copy_package(tmp_path_factory.mktemp("filled"))
    assert answer(folder, NUMBA_CACHE_DIR=folder / "kernels") == ANSWER
    return folder


@pytest.fixture
def filled_copy(filled, tmp_path):
    """One to write to; the names of the kernels do not depend on the place."""
    return Path(shutil.copytree(filled, tmp_path / "site"))


# Where kernels are kept


def test_second_process_loads_the_kernel(filled_copy):
    before = kernels(filled_copy)
    assert len(before) == 1
    assert {path.parent for path in before} == {filled_copy / "kernels" / "collide"}
    # No compiler, no compilation.
    code = (
        "import collide; from numba.core import compiler; "
        f"compiler.compile_extra = compiler.compile_ir = lambda *_, **__: 1 / 0; {SHOW}"
    )
    assert answer(filled_copy, code, NUMBA_CACHE_DIR=filled_copy / "kernels") == ANSWER
    assert kernels(filled_copy) == before


def test_kernels_are_kept_beside_the_code(folder):
    assert answer(folder) == ANSWER
    before = kernels(folder)
    assert {path.parent for path in before} == {folder / "collide" / "__pycache__"}
    assert answer(folder) == ANSWER
    assert kernels(folder) == before


# Permissions do not hold back the superuser, a regular file in the place of a folder does.
def make_unwritable(folder):
    (folder / "collide" / "__pycache__").write_text("")


def test_kernels_are_kept_at_home_where_the_package_is_read_only(folder):
    make_unwritable(folder)
    cache = folder / "home" / ".cache" / "collide"
    assert answer(folder) == ANSWER
    before = kernels(folder)
    assert {path.parent for path in before} == {cache}
    assert answer(folder) == ANSWER
    assert kernels(folder) == before


@pytest.mark.parametrize(
    "variable",
    ["HOME", *(pytest.param(name, marks=pytest.mark.campaign) for name in ("XDG_CACHE_HOME", "NUMBA_CACHE_DIR"))],
)
def test_works_where_nothing_is_writable(variable, folder):
    make_unwritable(folder)
    (folder / "file").write_text("")
    assert answer(folder, **{variable: folder / "file" / "below"}) == ANSWER
    assert kernels(folder) == {}


# Stale kernels


def test_edit_of_a_formula_is_seen_at_once(filled_copy):
    cache = filled_copy / "kernels"
    edit(filled_copy, FORMULA, EDITED_FORMULA)
    assert answer(filled_copy, NUMBA_CACHE_DIR=cache) == EDITED_ANSWER
    edit(filled_copy, EDITED_FORMULA, FORMULA)
    before = kernels(cache)
    assert len(before) == 2
    assert answer(filled_copy, NUMBA_CACHE_DIR=cache) == ANSWER
    assert kernels(cache) == before


def test_edit_under_a_running_process_leaves_no_stale_kernel(folder):
    """The process goes on with the code that it has imported, and may not pass it off as the new one."""
    cache = folder / "kernels"
    wait = f"import collide; print(flush=True); input(); {SHOW}"
    variables = environment(folder, NUMBA_CACHE_DIR=cache)
    with process.running(sys.executable, "-c", wait, cwd=folder, env=variables, stdin=process.PIPE) as waiting:
        assert waiting.stdout.readline() == "\n"
        edit(folder, FORMULA, EDITED_FORMULA)
        assert waiting.communicate("\n", timeout=60)[0] == ANSWER
    assert answer(folder, NUMBA_CACHE_DIR=cache) == EDITED_ANSWER


def test_fifo_in_a_kernels_place_is_not_waited_for(filled_copy):
    if sys.platform == "win32":
        pytest.skip("Windows has no os.mkfifo: no file there is a pipe")
    (path,) = kernels(filled_copy / "kernels")
    path.unlink()
    os.mkfifo(path)
    assert answer(filled_copy, NUMBA_CACHE_DIR=filled_copy / "kernels") == ANSWER
    assert path.is_file()


def test_names_of_the_installed_distributions_are_not_needed(filled_copy):
    """Frozen applications have none."""
    code = f"import importlib.metadata; importlib.metadata.version = None; {CALL}"
    before = kernels(filled_copy)
    assert answer(filled_copy, code, NUMBA_CACHE_DIR=filled_copy / "kernels") == ANSWER
    assert kernels(filled_copy) == before


def test_sources_that_cannot_be_read(folder):
    (folder / "collide" / "a folder.py").mkdir()
    assert answer(folder) == ANSWER
    assert kernels(folder) == {}


# Several processes


@sizes(usual=1, campaign=10)
def test_two_processes_may_fill_one_cache_at_once(folder, size):
    for k in range(size):
        check_two_processes(folder, folder / f"kernels {k}")


def check_two_processes(folder, cache):
    options = {"cwd": folder, "env": environment(folder, NUMBA_CACHE_DIR=cache), "stderr": process.PIPE}
    with ExitStack() as both:
        pair = [both.enter_context(process.running(sys.executable, "-c", CALL, **options)) for _ in range(2)]
        assert [one.communicate(timeout=60) for one in pair] == [(ANSWER, "")] * 2
    # One kernel, and no temporary file left behind.
    assert [path.suffix for path in (cache / "collide").iterdir()] == [".nbc"]
    before = kernels(cache)
    assert answer(folder, NUMBA_CACHE_DIR=cache) == ANSWER
    assert kernels(cache) == before


# Without the compiler


def test_formulas_work_without_the_compiler(folder):
    code = "import collide; print(*map(float, collide.scalar.resolve_1d(1.0, 3.0, 4.0, 0.0)))"
    assert answer(folder, code, NUMBA_DISABLE_JIT=1) == "-2.0 2.0\n"


@pytest.mark.parametrize("array", [True, False], ids=["array", "scalar"])
def test_batch_functions_without_the_compiler_say_so(array, folder):
    code = f"import collide, numpy as np; a = np.ones(3) if {array} else 1.0; collide.resolve_1d(a, a, a, a)"
    done = process.python(code, cwd=folder, env=environment(folder, NUMBA_DISABLE_JIT=1))
    assert done.returncode == 1
    last = done.stderr.splitlines()[-1]
    assert last.startswith("RuntimeError: ")
    assert "NUMBA_DISABLE_JIT" in last


def test_import_gives_no_warning_and_compiles_nothing(folder):
    code = "import collide; print(collide.__file__)"
    assert answer(folder, code, PYTHONWARNINGS="error") == f"{folder / 'collide' / '__init__.py'}\n"
    assert kernels(folder) == {}

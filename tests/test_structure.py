"""The house rules that a reader relies on: who imports whom, and where compile options may be."""

import ast
import re
import subprocess
import sys
from pathlib import Path

import pytest

import collide

PACKAGE = Path(collide.__file__).parent
# Each module imports from earlier lines only.
ORDER = [
    ["_starting", "_cache", "_locks", "_output"],
    ["_jit"],
    ["_lanes"],
    ["_elementwise", "_memory"],
    ["_exact"],
    ["_sincos"],
    ["scalar"],
    ["_kernels", "errors", "_threads"],
    ["_limit", "_arrays", "_grid"],
    ["_neighbours", "_sequential", "_conservation", "_tables"],
    ["batch", "contacts", "arrow", "_stream"],
    ["_numpy_files", "_arrow_files", "dask"],
    ["_ipc_files", "_csv_files"],
    ["__init__"],
    ["_demo"],
    ["__main__"],
]
OPTIONS = re.compile(
    r"^\s*@(numba\.)?(n?jit|(gu)?vectorize)\b|\b(n?jit|register_jitable)\(|fastmath|error_model", re.MULTILINE
)
RANK = {name: i for i, names in enumerate(ORDER) for name in names}


def imports(path):
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.ImportFrom) and node.level == 1:
            for alias in node.names:
                name = node.module or alias.name
                yield name if name in RANK else "__init__"


@pytest.mark.parametrize("path", sorted(PACKAGE.glob("*.py")), ids=lambda path: path.stem)
def test_imports_run_one_way(path):
    assert path.stem in RANK, "a new module needs its place in the order"
    for name in imports(path):
        assert RANK[name] < RANK[path.stem] or (path.stem, name) == ("__main__", "_demo")


@pytest.mark.parametrize("path", sorted(PACKAGE.glob("*.py")), ids=lambda path: path.stem)
def test_compile_options_are_in_one_place(path):
    if path.stem != "_jit":
        assert not OPTIONS.search(path.read_text())


@pytest.mark.parametrize("path", sorted(PACKAGE.glob("examples/*.py")), ids=lambda path: path.stem)
def test_examples_compile_as_a_user_would_without_options(path):
    assert not OPTIONS.search(re.sub(r"^@numba\.njit(?=\s)", "", path.read_text(), flags=re.MULTILINE))


def test_the_public_names():
    assert set(collide.__all__) == {
        "InvalidPairError",
        "find_contacts",
        "get_num_threads",
        "impulse_2d",
        "resolve_1d",
        "resolve_2d",
        "resolve_contacts",
        "resolve_polar",
        "scalar",
        "set_num_threads",
        "time_of_impact",
    }
    for name in collide.__all__:
        assert getattr(collide, name).__doc__


def test_importing_needs_numpy_and_numba_only():
    code = (
        "import sys, numba; before = set(sys.modules); import collide; "
        "print(sorted({name.split('.')[0] for name in set(sys.modules) - before} - set(sys.stdlib_module_names)))"
    )
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=True)
    assert set(ast.literal_eval(run.stdout)) <= {"collide", "llvmlite", "numba", "numpy"}


def test_importing_without_docstrings():
    code = "import collide; print(collide.resolve_2d.__doc__, collide.resolve_1d(1.0, 1.0, 3.0, 5.0))"
    run = subprocess.run([sys.executable, "-OO", "-c", code], capture_output=True, text=True, timeout=60, check=True)
    assert run.stdout.startswith("None Velocities1D(u1=np.float64(5.0)")


@pytest.mark.parametrize("other", ["sys.byteorder = 'big'", "sys.maxsize = 2**31 - 1"])
def test_other_platforms_are_refused(other):
    code = f"import sys; {other}; import collide"
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=False)
    assert "ImportError: collide needs a 64-bit, little-endian platform" in run.stderr

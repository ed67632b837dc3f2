"""The house rules that a reader relies on: who imports whom, and where compile options may be."""

import ast
import re
import sys
from pathlib import Path

import pytest

import collide
from tests.helpers import elsewhere, process

PACKAGE = Path(collide.__file__).parent
PROJECT = Path(__file__).parents[2] / "pyproject.toml"
# Each module imports from earlier lines only.
ORDER = """
    _typing  _system.signals  _system.locks  _system.forks  _system.disk  _system.ownership  _system.renaming
    _system.memory  _system.messages  _system.processors  _system.settings  _tables.replacement
    _compile.versions
    _compile.cache
    _compile.options
    _compile.kernel  _system.threads
    _compile.lanes
    _compile.words
    _compile.arrays
    _compile.components  _compile.elementwise  _compile.memory  _compile.allocator  _compile.team
    _compile.kept_memory
    _compile.pieces
    _compile.gather
    _formulas.exact
    _formulas.sincos  _formulas.impact
    _formulas.collision
    scalar
    _pairs.loop
    _pairs.forms  errors  _pairs.arguments
    _pairs.results  _pairs.blocks
    _cli.limit  _cli.status_line  _cli.against_numpy  _pairs.execution  _contacts.torus  _contacts.state
    _contacts.grid
    _contacts.layout
    _contacts.at_once
    _contacts.search  _tables.conservation  _tables.missing  _tables.standard  _pairs.vectors
    _tables.by_name
    _contacts.in_order
    _contacts.resolution
    _contacts.walls
    batch  contacts  _pairs.chunks  _tables.stream  _tables.arrow_batches
    _tables.conversion
    arrow  _tables.numpy_files  _tables.arrow_files  dask
    _tables.npy_folders  _tables.npz_files  _tables.parquet_files  _tables.ipc_files  _tables.csv_files  _tables.formats
    __init__  _cli.kernels  _cli.messages
    _cli.demo  _cli.bench  _cli.resolve
    __main__
"""
RANK = {name: i for i, line in enumerate(ORDER.splitlines()) for name in line.split()}
MODULES = [path for path in sorted(PACKAGE.rglob("*.py")) if path.parent.name != "examples"]
ROOMS = {path.parent.name for path in MODULES} - {PACKAGE.name}
OPTIONS = re.compile(
    r"^\s*@(numba\.)?(n?jit|(gu)?vectorize)\b|\b(n?jit|register_jitable)\(|fastmath|error_model", re.MULTILINE
)


def name_of(path):
    return ".".join(path.relative_to(PACKAGE).with_suffix("").parts)


def imports(path):
    """The modules that one takes something from, by the package's own names."""
    here = name_of(path).split(".")[:-1]
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.ImportFrom) and node.level > 0:
            base = [*here[: len(here) + 1 - node.level], *(node.module or "").split(".")]
            for alias in node.names:
                whole = ".".join(part for part in (*base, alias.name) if part)
                yield next((name for name in (whole, whole.rpartition(".")[0]) if name in RANK), "__init__")


@pytest.mark.fast
@pytest.mark.parametrize("path", MODULES, ids=name_of)
def test_imports_run_one_way(path):
    if path.name == "__init__.py" and path.parent != PACKAGE:
        assert not list(imports(path))
        return
    assert name_of(path) in RANK, "a new module needs its place in the order"
    for name in imports(path):
        assert RANK[name] < RANK[name_of(path)], name


@pytest.mark.fast
def test_every_room_says_what_it_is_for():
    for room in ROOMS:
        assert len(ast.get_docstring(ast.parse((PACKAGE / room / "__init__.py").read_text()))) > 20


@pytest.mark.fast
@pytest.mark.parametrize("path", MODULES, ids=name_of)
def test_compile_options_are_in_one_place(path):
    if name_of(path) != "_compile.options":
        assert not OPTIONS.search(path.read_text())


@pytest.mark.parametrize("path", sorted(PACKAGE.glob("examples/*.py")), ids=lambda path: path.stem)
def test_examples_compile_as_a_user_would_without_options(path):
    assert not OPTIONS.search(re.sub(r"^@numba\.njit(?=\s)", "", path.read_text(), flags=re.MULTILINE))


# What is everywhere and not the same, beside what some systems lack; "": the module is not to be imported at all.
DIFFERENT = {
    "ctypes": {"CDLL", "FormatError", "OleDLL", "WinDLL", "WinError", "cdll", "oledll", "util", "windll"},
    "os": {"chmod", "fsync", "kill", "link", "name", "process_cpu_count", "rename", "symlink", "umask"},
    "platform": {""},
    "sys": {"getwindowsversion", "platform"},
    "tempfile": {""},  # before Python 3.13 it tries 2**31 names in a folder of Windows's that is not writable
}
ASKED = {"ctypes", "mmap", "os", "select", "signal", "socket", "time"}  # by hasattr and getattr


def asks_the_system(tree):
    """What a module uses that is not on all systems or not the same there, or looks for."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            used = [(alias.name, "") for alias in node.names]
            if any(alias.asname and alias.name in {*DIFFERENT, *elsewhere.LACKS["windows"]} for alias in node.names):
                yield ast.unparse(node)  # by another name it would not be found below
        elif isinstance(node, ast.ImportFrom) and not node.level:
            used = [(node.module, ""), *((node.module, alias.name) for alias in node.names)]
        elif isinstance(node, ast.Attribute):
            used = [(ast.unparse(node.value), node.attr)]
        elif isinstance(node, ast.Call):
            used = []
            if ast.unparse(node.func) in ("hasattr", "getattr") and ast.unparse(node.args[0]) in ASKED:
                yield ast.unparse(node)
        else:
            used = []
        for module, name in used:
            somewhere_not = any(elsewhere.lacks(system, module, name) for system in elsewhere.SYSTEMS)
            if somewhere_not or name in DIFFERENT.get(module, ()):
                yield f"{module}.{name}"


@pytest.mark.fast
@pytest.mark.parametrize("path", sorted(PACKAGE.rglob("*.py")), ids=name_of)
def test_systems_are_told_apart_in_one_room_only(path):
    if path.parent.name != "_system":
        assert not list(asks_the_system(ast.parse(path.read_text())))


@pytest.mark.fast
@pytest.mark.parametrize(
    "code",
    [
        "os.fchmod(handle, 0o644)",
        "if hasattr(os, 'fchmod'): pass",
        "getattr(signal, 'SIGHUP', None)",
        "from os import fork",
        "from sys import platform as p",
        "import os as o",
        "import fcntl",
        "from resource import getrlimit",
        "import tempfile",
        "sys.platform == 'win32'",
        "os.name",
        "platform.system()\nimport platform",
        "ctypes.CDLL(None)",
        "lambda: signal.SIGHUP",
        "mapped.madvise(mmap.MADV_SEQUENTIAL)",
        "os.open(path, os.O_NOFOLLOW)",
    ],
)
def test_what_tells_systems_apart_is_found(code):
    assert list(asks_the_system(ast.parse(code)))


@pytest.mark.fast
def test_the_public_names():
    assert set(collide.__all__) == {
        "InvalidPairError",
        "__version__",
        "find_contacts",
        "get_num_threads",
        "get_spare_memory",
        "impulse_2d",
        "impulse_3d",
        "resolve",
        "resolve_1d",
        "resolve_2d",
        "resolve_3d",
        "resolve_contacts",
        "resolve_pairs",
        "resolve_polar",
        "resolve_walls",
        "scalar",
        "set_num_threads",
        "set_spare_memory",
        "time_of_impact",
        "time_of_impact_3d",
    }
    for name in collide.__all__:
        assert getattr(collide, name).__doc__


def test_what_dir_shows_is_public():
    assert dir(collide) == sorted(collide.__all__)


@pytest.mark.parametrize(
    ("name", "package", "extra"), [("arrow", "pyarrow", "pyarrow"), ("dask", "dask", "dask[array]")]
)
def test_what_is_imported_on_demand(name, package, extra):
    code = f"import collide; print(collide.{name}.resolve.__module__)"
    assert process.python(code).stdout == f"collide.{name}\n"
    done = process.python(f"import sys; sys.modules['{package}'] = None; {code}")
    assert f"ModuleNotFoundError: collide.{name} needs {package}: pip install " in done.stderr and extra in done.stderr
    assert (
        "AttributeError: module 'collide' has no attribute 'no'" in process.python("import collide; collide.no").stderr
    )


def test_importing_needs_numpy_and_numba_only():
    code = (
        "import sys, numba; before = set(sys.modules); import collide; "
        "print(sorted({name.split('.')[0] for name in set(sys.modules) - before} - set(sys.stdlib_module_names)))"
    )
    assert set(ast.literal_eval(process.printed_by(code))) <= {"collide", "llvmlite", "numba", "numpy"}


def test_importing_without_docstrings():
    code = "import collide; print(collide.resolve_2d.__doc__, collide.resolve_1d(1.0, 1.0, 3.0, 5.0))"
    done = process.run(sys.executable, "-OO", "-c", code)
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.startswith("None Velocities1D(u1=np.float64(5.0)")


@pytest.mark.parametrize("other", ["sys.byteorder = 'big'", "sys.maxsize = 2**31 - 1"])
def test_other_platforms_are_refused(other):
    code = f"import sys; {other}; import collide"
    assert "ImportError: collide needs a 64-bit, little-endian platform" in process.python(code).stderr


@pytest.mark.parametrize(
    ("name", "package", "taken", "refused"),
    [
        ("Numba", "numba", ["0.62.0", "0.68.99"], ["0.61.2", "0.69.0rc1", "1.0.0"]),
        ("NumPy", "numpy", ["2.1.0"], ["1.26.4", "2.0.2", "2.6.0.dev0"]),
    ],
)
def test_other_versions_are_refused(name, package, taken, refused):
    """By a sentence with the range, which is that of pyproject.toml."""
    ((low, high),) = re.findall(rf'"{package}>=(.*?),<(.*?)"', PROJECT.read_text())
    for version in (*taken, *refused):
        said = process.python(f"import {package}; {package}.__version__ = '{version}'; import collide").stderr
        refusal = f"ImportError: collide needs {name} >= {low} and < {high}, and here is {version}\n"
        assert said.endswith(refusal) if version in refused else not said


# What of Numba and llvmlite no documentation promises: where a new version breaks the package, it is one of these.
PRIVATE = {
    "llvmlite.ir",
    "numba.core.caching.NullCache",
    "numba.core.ccallback.CFunc",
    "numba.core.cgutils",
    "numba.core.compiler.CompileResult",
    "numba.core.compiler_lock.global_compiler_lock",
    "numba.core.config",
    "numba.core.serialize.dumps",
    "numba.core.typing.templates.AbstractTemplate",
    "numba.core.typing.templates.infer_global",
    "numba.core.typing.templates.signature",
}
PRIVATE_ATTRIBUTES = {"_cache", "_getvalue", "_rebuild", "_reduce", "_search_new_conversions"}
PUBLIC = {
    "llvmlite",
    "numba",
    "numba.extending.lower_builtin",
    "numba.extending.models",
    "numba.extending.overload",
    "numba.extending.register_jitable",
    "numba.extending.register_model",
    "numba.from_dtype",
    "numba.types",
}


def test_private_interfaces_of_numba_are_used_in_one_room_only():
    used: dict[str, set[str]] = {}
    attributes: dict[str, set[str]] = {}
    for path in MODULES:
        for node in ast.walk(ast.parse(path.read_text())):
            names = []
            if isinstance(node, ast.Import):
                names = [alias.name for alias in node.names]
            elif isinstance(node, ast.ImportFrom) and node.level == 0:
                names = [f"{node.module}.{alias.name}" for alias in node.names]
            for name in names:
                if name.split(".")[0] in ("numba", "llvmlite") and name not in PUBLIC:
                    used.setdefault(name, set()).add(path.parent.name)
            if path.parent.name == "_compile" and isinstance(node, ast.Attribute) and re.match("_[a-z]", node.attr):
                attributes.setdefault(node.attr, set()).add(ast.unparse(node.value))
    assert used == {name: {"_compile"} for name in PRIVATE}
    assert {name for name, owners in attributes.items() if owners != {"self"}} == PRIVATE_ATTRIBUTES

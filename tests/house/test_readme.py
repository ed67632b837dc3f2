"""Every code block of the README runs as printed, and every example in a docstring gives what it says."""

import doctest
import importlib
import operator
import pkgutil
import re
import sys
from pathlib import Path

import numba
import numpy as np
import pyarrow as pa
import pyarrow.csv
import pyarrow.parquet as pq
import pytest

import collide
from tests.helpers import process

ROOT = Path(__file__).parents[2]
README = (ROOT / "README.md").read_text()
BLOCKS = re.findall(r"^```(\w+)\n(.*?)^```", README, re.MULTILINE | re.DOTALL)
# What sets up and runs things in the clone: known by heart here, and run by CI or by hand.
KNOWN = {
    "python3 -m venv .venv && .venv/bin/pip install . && .venv/bin/python -m collide demo",
    'python3 -m venv .venv && .venv/bin/pip install -e ".[test]" && .venv/bin/python -m pytest',
    'python3 -m venv .venv && .venv/bin/pip install -e ".[bench]" && .venv/bin/python -m pytest benchmarks',
    ".venv/bin/python -m pytest benchmarks --benchmark-autosave",
    ".venv/bin/python -m pytest benchmarks --benchmark-compare",
    ".venv/bin/python -m pytest benchmarks -k collide --benchmark-compare --benchmark-compare-fail=median:30%",
}


def blocks(language):
    found = [text for name, text in BLOCKS if name == language]
    return [pytest.param(text, id=f"{language}-{i}") for i, text in enumerate(found)]


def test_no_block_is_left_out():
    assert {name for name, _ in BLOCKS} == {"python", "sh", "text"}


@pytest.mark.parametrize("text", blocks("python"))
def test_python(text, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    if ">>>" in text:
        runner = doctest.DocTestRunner(optionflags=doctest.NORMALIZE_WHITESPACE)
        runner.run(doctest.DocTestParser().get_doctest(text, {}, "README", "README.md", 0))
        assert runner.failures == 0
    else:
        exec(compile(text, "README.md", "exec"), {"__name__": "readme"})


def shell_blocks():
    """That of the examples takes long, and test_examples.py has them in a small version."""
    for block in blocks("sh"):
        examples = "collide.examples" in block.values[0]
        yield pytest.param(*block.values, id=block.id, marks=pytest.mark.campaign if examples else ())


@pytest.mark.parametrize("text", [*shell_blocks()])
def test_shell(text, tmp_path):
    """The commands of the clone are known; the rest is run here, on a file that the README describes."""
    columns = {k: np.ones(3) for k in ("m1", "m2", "v1x", "v1y", "v2x", "v2y", "nx", "ny")}
    np.savez(tmp_path / "pairs.npz", **columns)
    (tmp_path / "pairs").mkdir()
    for name, column in columns.items():
        np.save(tmp_path / "pairs" / f"{name}.npy", column)
    pa.csv.write_csv(pa.table(columns), tmp_path / "pairs.csv")
    renamed = {{"m1": "mass_a", "m2": "mass_b"}.get(k, k): column for k, column in columns.items()}
    pq.write_table(pa.table(renamed), tmp_path / "pairs.parquet")
    for line in text.splitlines():
        if line not in KNOWN:
            command = re.sub(r"^(python -m collide|collide)\b", f"{sys.executable} -m collide", line)
            done = process.run("sh", "-c", command, cwd=tmp_path)
            assert done.returncode == 0, done.stderr


def test_ci_runs_the_second_command():
    text = (ROOT / ".ci" / "run").read_text()
    assert "grep -m 1 -- '-m pytest$' README.md" in text
    assert re.search(r"-m pytest$", README, re.MULTILINE)


MODULES = [m.name for m in pkgutil.walk_packages(collide.__path__, "collide.") if m.name != "collide.__main__"]


@pytest.mark.parametrize("name", MODULES)
def test_docstrings(name, keep_threads):
    module = importlib.import_module(name)
    result = doctest.testmod(module, extraglobs={"collide": collide, "np": np, "numba": numba})
    assert result.failed == 0


def test_there_are_examples():
    finder = doctest.DocTestFinder()
    functions = [
        *(set(collide.__all__) - {"InvalidPairError", "__version__", "scalar"}),
        *(f"scalar.{f}" for f in collide.scalar.__all__),
    ]
    for name in functions:
        item = operator.attrgetter(name)(collide)
        assert any(test.examples for test in finder.find(item, name)), name

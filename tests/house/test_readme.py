"""Every code block of the README runs as printed, and every example in a docstring gives what it says."""

import doctest
import gzip
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
}
TEXTS = ["README.md", "tests/README.md", "benchmarks/README.md", ".github/CONTRIBUTING.md", ".github/CHANGELOG.md"]


def blocks(language):
    found = [text for name, text in BLOCKS if name == language]
    return [pytest.param(text, id=f"{language}-{i}") for i, text in enumerate(found)]


def test_no_block_is_left_out():
    assert {name for name, _ in BLOCKS} == {"python", "sh"}


def test_it_is_short():
    assert len(README.splitlines()) < 250
    assert max(len(line) for line in README.splitlines() if line[:1] not in ("|", "!", " ")) <= 120


@pytest.mark.parametrize("name", TEXTS)
def test_links_lead_somewhere(name):
    """To files, and to headings in them."""
    text = (ROOT / name).read_text()
    for link in re.findall(r"\]\(([^)#\s]*(?:#[\w-]+)?)\)", text):
        if "://" not in link:
            path, _, heading = link.partition("#")
            found = (ROOT / name).parent / path if path else ROOT / name
            assert found.exists(), link
            headings = re.findall(r"^#+ (.*)$", found.read_text(), re.MULTILINE) if heading else [""]
            assert heading in [h.lower().replace(" ", "-") for h in headings], link


@pytest.mark.parametrize("name", TEXTS)
def test_tests_and_functions_that_are_named_are_there(name):
    text = (ROOT / name).read_text()
    tests = {path.name for folder in ("tests", "benchmarks") for path in (ROOT / folder).rglob("test_*.py")}
    assert {*re.findall(r"\btest_\w+\.py", text)} <= tests
    for function in re.findall(r"\bcollide\.((?:scalar\.)?[a-z]\w+)\(", text):
        assert operator.attrgetter(function)(collide)


def test_the_error_that_it_quotes():
    with pytest.raises(collide.InvalidPairError) as caught:
        collide.resolve_1d([1.0, -1.0, 1.0], 2.0, [3.0, 3.0, 3.0], 0.0)
    assert f"`{caught.value}`" in " ".join(README.split())


@pytest.mark.parametrize("text", blocks("python"))
def test_python(text, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    exec(compile(text, "README.md", "exec"), {"__name__": "readme"})


@pytest.mark.parametrize("text", blocks("sh"))
def test_shell(text, tmp_path):
    """The commands of the clone are known; the rest is run here, on a file that the README describes."""
    columns = {k: np.ones(3) for k in ("m1", "m2", "v1x", "v1y", "v2x", "v2y", "nx", "ny")}
    np.savez(tmp_path / "pairs.npz", **columns)
    (tmp_path / "pairs").mkdir()
    for name, column in columns.items():
        np.save(tmp_path / "pairs" / f"{name}.npy", column)
    pa.csv.write_csv(pa.table(columns), tmp_path / "pairs.csv", pa.csv.WriteOptions(delimiter=";"))
    with gzip.open(tmp_path / "pairs.tsv.gz", "wb") as file:
        pa.csv.write_csv(pa.table(columns), file, pa.csv.WriteOptions(delimiter="\t"))
    renamed = {{"m1": "mass_a", "m2": "mass_b"}.get(k, k): column for k, column in columns.items()}
    pq.write_table(pa.table(renamed), tmp_path / "pairs.parquet")
    for line in text.splitlines():
        if line not in KNOWN:
            command = re.sub(r"(^|\| )collide\b", rf"\1{sys.executable} -m collide", line)
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

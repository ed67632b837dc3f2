"""What the tests of files, of the command line and of Arrow share: a table for each form, files of all formats, runs of
the command line, and how a fault is said.
"""

from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.csv
import pyarrow.parquet as pq
import pytest

import collide
from collide.__main__ import main

N = 1000
RNG = np.random.default_rng(0)


def _columns(*names: str) -> dict[str, Any]:
    return {name: RNG.uniform(0.5, 2.0, N) for name in names}


LINE = _columns("m1", "m2", "v1", "v2")
PLANE = _columns("m1", "m2", "v1x", "v1y", "v2x", "v2y", "nx", "ny")
POLAR = _columns("m1", "m2", "v1", "theta1", "v2", "theta2", "phi")
SPACE = _columns("m1", "m2", "v1x", "v1y", "v1z", "v2x", "v2y", "v2z", "nx", "ny", "nz")
FORMS: dict[str, tuple[dict[str, Any], Any]] = {
    "1d": (LINE, collide.resolve_1d),
    "2d": (PLANE, collide.resolve_2d),
    "3d": (SPACE, collide.resolve_3d),
    "polar": (POLAR, collide.resolve_polar),
}


def assert_one_line(capsys: pytest.CaptureFixture[str], *words: object) -> None:
    """The command line said one line, which holds these words, and nothing else."""
    captured = capsys.readouterr()
    assert captured.out == ""
    assert len(captured.err.splitlines()) == 1, captured.err
    assert captured.err.startswith("collide: ")
    for word in words:
        assert str(word) in captured.err, captured.err


FORMATS = (".parquet", ".arrow", ".arrows", ".csv", "")
# A test that starts processes goes through all formats as a campaign only.
FEW = [".parquet", "", *(pytest.param(suffix, marks=pytest.mark.campaign) for suffix in (".arrow", ".arrows", ".csv"))]
few_formats = pytest.mark.parametrize("paths", FEW, indirect=True, ids=lambda suffix: suffix or "folder")


def write(path: Path, columns: Any, **options: Any) -> Path:
    """A table in the format that the path is of."""
    if path.suffix == "":
        path.mkdir()
        for name, column in columns.items():
            np.save(path / f"{name}.npy", column)
        return path
    table = columns if isinstance(columns, pa.Table) else pa.table(columns)
    if path.suffix == ".parquet":
        pq.write_table(table, path, **{"row_group_size": 400, **options})
    elif path.suffix == ".csv":
        pa.csv.write_csv(table, path)
    else:
        new = pa.ipc.new_file if path.suffix == ".arrow" else pa.ipc.new_stream
        with new(path, table.schema, **options) as writer:
            writer.write_table(table)
    return path


def read(path: Path) -> Any:
    if path.suffix == "":
        return {file.stem: np.load(file, allow_pickle=True) for file in sorted(path.glob("*"))}
    if path.suffix == ".parquet":
        return pq.read_table(path)
    if path.suffix == ".csv":
        return pa.csv.read_csv(path)
    opened = pa.ipc.open_file if path.suffix == ".arrow" else pa.ipc.open_stream
    with pa.OSFile(str(path)) as file:
        return opened(file).read_all()


def status(*arguments: object) -> Any:
    """The exit status, which is argparse's own way to end on some errors."""
    try:
        return main([str(argument) for argument in arguments])
    except SystemExit as end:
        return end.code


def resolve(source: object, target: object, *options: object) -> Any:
    return status("resolve", source, "-o", target, *options)


def assert_refused(capsys: pytest.CaptureFixture[str], target: Path, *words: object) -> None:
    assert_one_line(capsys, *words)
    assert not list(target.parent.glob(".*"))  # nothing is left behind
    assert not target.exists()


FOREIGN = {
    "name": pa.array(["red", "grün", "", "a,b", 'say "so"', "two\nlines", "007", " x ", None, "1.50"] * (N // 10)),
    "tags": pa.array([[1, 2], None, [], [3], [4, 5]] * (N // 5)),
    "kind": pa.array(["x", "y"] * (N // 2)).dictionary_encode(),
    "when": pa.array([0, None] * (N // 2), pa.timestamp("us", tz="UTC")),
    "nested": pa.array([{"a": 1, "b": None}, {"a": 2, "b": "c"}] * (N // 2)),
    "price": pa.array([None, "1.25"] * (N // 2), pa.string()).cast(pa.decimal128(9, 2)),
}

"""What the tests of .npz archives and of the command line share: tables of a hundred rows, and their files."""

import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.helpers import tables

N = 100
FORMS: dict[str, tuple[dict[str, Any], Any]] = {
    form: ({name: column[:N] for name, column in columns.items()}, function)
    for form, (columns, function) in tables.FORMS.items()
}
LINE, PLANE, SPACE, POLAR = (columns for columns, _ in FORMS.values())


def write(path: Path, columns: Mapping[str, Any]) -> None:
    """As numpy.savez, but under any names and without a word about objects."""
    with zipfile.ZipFile(path, "w") as archive:
        for name, column in columns.items():
            with archive.open(f"{name}.npy", "w") as file:
                np.lib.format.write_array(file, np.asanyarray(column))


def read(path: Path) -> dict[str, Any]:
    with np.load(path, allow_pickle=False) as archive:
        return {name: archive[name] for name in archive.files}


def identical(a: Any, b: Any) -> bool:
    return bool(a.dtype == b.dtype and a.shape == b.shape and a.tobytes() == b.tobytes())


def assert_resolved(columns: Mapping[str, Any], target: Path, expected: Any) -> None:
    """All the input's columns, bit for bit and in order, and after them the results."""
    written = read(target)
    whole = {**{name: np.asanyarray(c) for name, c in columns.items()}, **expected._asdict()}
    assert list(written) == list(whole)
    for name, column in whole.items():
        assert identical(written[name], column), name


def assert_refused(capsys: pytest.CaptureFixture[str], target: Path, *words: object) -> None:
    """One line that holds these words, no output, nothing left behind."""
    tables.assert_one_line(capsys, *words)
    assert list(target.parent.iterdir()) == []


def without(columns: Mapping[str, Any], *names: str) -> dict[str, Any]:
    return {name: column for name, column in columns.items() if name not in names}

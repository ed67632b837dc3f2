"""What the tests of files share."""

import pytest

from collide._tables import arrow_files, csv_files, stream
from tests.helpers.tables import FORMATS


@pytest.fixture
def small_blocks(monkeypatch):
    """So that a table of a thousand rows has several."""
    monkeypatch.setattr(stream, "ROWS", 300)
    monkeypatch.setattr(arrow_files, "BLOCK_BYTES", 1 << 15)
    monkeypatch.setattr(csv_files, "_TEXT_BYTES", 1 << 14)


@pytest.fixture(params=FORMATS, ids=lambda suffix: suffix or "folder")
def paths(request, tmp_path):
    """Of an input and of an output, which has a folder of its own, so that whatever is left behind there shows."""
    (tmp_path / "out").mkdir()
    return tmp_path / f"pairs{request.param}", tmp_path / "out" / f"after{request.param}"

"""What the tests of files share."""

import pytest

from tests.helpers.tables import FORMATS


@pytest.fixture(params=FORMATS, ids=lambda suffix: suffix or "folder")
def paths(request, tmp_path):
    """Of an input and of an output, which has a folder of its own, so that whatever is left behind there shows."""
    (tmp_path / "out").mkdir()
    return tmp_path / f"pairs{request.param}", tmp_path / "out" / f"after{request.param}"

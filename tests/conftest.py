"""Shared set-up: a cache of compiled kernels of the tests' own."""

import os
import signal
from pathlib import Path

# Before numba is imported. The names of the files in it cover the sources, so nothing stale is served from it.
os.environ.setdefault("NUMBA_CACHE_DIR", str(Path(__file__).parent / ".kernels"))

import pytest

import collide

# Whoever starts the tests in the background has interrupts ignored, and what they start would inherit that.
signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.fixture
def keep_threads():
    """Puts the number of threads back."""
    before = collide.get_num_threads()
    yield
    collide.set_num_threads(before)


@pytest.fixture
def small_blocks(monkeypatch):
    """So that a table of a thousand rows has several."""
    monkeypatch.setattr("collide._tables.stream.ROWS", 300)
    monkeypatch.setattr("collide._tables.arrow_files.BLOCK_BYTES", 1 << 15)
    monkeypatch.setattr("collide._tables.csv_files._TEXT_BYTES", 1 << 14)


@pytest.fixture
def source(tmp_path):
    return tmp_path / "pairs.npz"


@pytest.fixture
def target(tmp_path):
    """In a folder of its own, so that whatever is left behind there shows."""
    folder = tmp_path / "results"
    folder.mkdir()
    return folder / "after.npz"

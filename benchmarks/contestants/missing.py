"""Contestants that cannot take part: what is not installed, and what is not measured."""

from __future__ import annotations

import importlib
import warnings
from typing import Any

import numba
from cases import IMPACTS, Case


class MissingError(Exception):
    """Why a contestant cannot run a case here."""


def peer(name: str) -> Any:
    """A module that the extra `peers` installs."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return importlib.import_module(name)
    except ImportError:
        raise MissingError(f'{name} is not installed: pip install -e ".[peers]"') from None


def collisions_on_all_threads_only(case: Case) -> None:
    if case.form in IMPACTS:
        raise MissingError("measured on collisions only")
    if case.threads < numba.config.NUMBA_NUM_THREADS:
        raise MissingError("measured on all threads only")

"""collide, which all others are measured against."""

from __future__ import annotations

from collections.abc import Callable
from importlib.metadata import entry_points
from typing import Any

from cases import RESULTS, Call, Case

import collide

FUNCTIONS: dict[str, Callable[..., Any]] = {
    "1d": collide.resolve_1d,
    "2d": collide.resolve_2d,
    "3d": collide.resolve_3d,
    "polar": collide.resolve_polar,
    "impact": collide.time_of_impact,
    "impact_3d": collide.time_of_impact_3d,
}


def batch(case: Case) -> Call:
    function = FUNCTIONS[case.form]
    if RESULTS[case.form] == 1:
        return lambda: (function(*case.columns, out=case.out[0]),)
    return lambda: function(*case.columns, out=case.out)


def command() -> Callable[[list[str]], int]:
    """What the command `collide` calls, which gives its exit status."""
    (found,) = entry_points(group="console_scripts", name="collide")
    command: Callable[[list[str]], int] = found.load()
    return command

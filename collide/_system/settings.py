"""What a user sets for the whole process: a whole number, by a call or by a variable of the environment."""

from __future__ import annotations

import operator
import os

import numpy as np

_MOST = 1 << 60


def integer(name: str, value: object, least: int, what: str = "") -> int:
    """The argument of a call, or an error that says what must be of it."""
    try:
        number = operator.index(None if isinstance(value, bool | np.bool_) else value)  # type: ignore[arg-type]
    except TypeError:
        raise TypeError(f"{name} = {value!r}: {what}must be an integer") from None
    if number < least:
        raise ValueError(f"{name} = {number}: {what}must be at least {least}")
    return number


def of_environment(variable: str, least: int) -> int | None:
    """The value of the variable, if it is set; one that is larger than any use counts as 2**60."""
    text = os.environ.get(variable)
    if not text:
        return None
    if not (text.isascii() and text.isdigit() and float(text) >= least):
        raise ValueError(f"{variable} = {text!r}: must be an integer of at least {least}")
    return int(min(float(text), _MOST))  # by float, as int() takes 4300 digits at most

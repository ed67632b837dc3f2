"""Tables, which are columns by name: the form that the names make, and the collisions of a run of rows."""

from __future__ import annotations

import numbers
import reprlib
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, NamedTuple

from .._pairs import execution
from .._pairs.forms import COLLISIONS, Form
from .._typing import Array
from ..errors import InvalidPairError
from . import missing as advice

_E = "restitution"


def counted(n: int, what: str) -> str:
    """1 pair, 2 pairs."""
    return f"{n:,} {what}{'' if n == 1 else 's'}"


class TableError(ValueError):
    """A table that cannot be resolved: the column, where there is one the row, and the rule."""

    def __init__(self, message: str, row: int | None = None) -> None:
        super().__init__(message)
        self.row = row  # which some formats can tell more of


class ColumnTypeError(TableError, TypeError):
    """A column that does not hold numbers."""


class Columns(NamedTuple):
    """Which columns of a table are the arguments of a form, and how its results are called."""

    form: Form
    inputs: dict[str, str]  # by the argument; restitution may be missing
    outputs: list[str]


class Options(NamedTuple):
    """What the batch functions take beside the columns."""

    restitution: float | None  # None: the column, or 1 where there is none
    approaching_only: bool
    invalid: str


def cannot_hold(name: str, what: str, target: str) -> ColumnTypeError:
    """Of a column that a format has no place for."""
    return ColumnTypeError(f"column {name}: {what}, which {target} cannot hold: choose another format (--to)")


def options(restitution: Any, approaching_only: bool, invalid: str) -> Options:
    """These options, the restitution checked and as a float; the functions that take the others check them."""
    if restitution is not None:
        is_number = isinstance(restitution, numbers.Real) and not isinstance(restitution, bool)
        if not (is_number and 0.0 <= restitution < 1e308):  # below what float() cannot hold, as 10**400
            raise ValueError(f"restitution = {reprlib.repr(restitution)}: must be None or a finite number >= 0")
        restitution = float(restitution)
    return Options(restitution, approaching_only, invalid)


def choose(names: Iterable[str], form: str | None, columns: Mapping[str, str] | None, options: Options) -> Columns:
    """The form that is asked for, or else the one whose columns are all there.

    `columns` gives the names of columns that are not called as the arguments and results are.
    """
    names, called = list(names), dict(columns or {})
    if form is not None and (not isinstance(form, str) or form not in COLLISIONS):
        raise ValueError(f"form = {form!r}: must be None or one of {', '.join(map(repr, COLLISIONS))}")
    among = COLLISIONS if form is None else {form: COLLISIONS[form]}
    _check_names(called, among.values())
    chosen = _form_of(names, called, among)
    inputs = {c: called.get(c, c) for c in chosen.columns if called.get(c, c) in names}
    if options.restitution is not None:
        inputs.pop(_E, None)
    outputs = [called.get(u, u) for u in chosen.outputs]
    for column in inputs.values():
        if names.count(column) > 1:
            raise TableError(f"column {column}: there are {names.count(column)} of that name")
    for k, column in enumerate(outputs):
        if column in names or column in outputs[:k]:
            raise TableError(
                f"column {column}: is there already, and would be written: `columns` (--columns) calls it otherwise"
            )
    return Columns(chosen, inputs, outputs)


def _check_names(called: Mapping[str, str], forms: Iterable[Form]) -> None:
    """Whether the names are given to arguments and results that some form has."""
    known = dict.fromkeys(name for form in forms for name in (*form.columns, *form.outputs))
    for name, column in called.items():
        if name not in known:
            raise ValueError(f"columns: {name!r} is not among {', '.join(known)}")
        if not isinstance(column, str):
            raise TypeError(f"columns: {name!r}: {column!r} is no name of a column")


def _form_of(names: Sequence[str], called: Mapping[str, str], among: Mapping[str, Form]) -> Form:
    """The one form whose columns are all there, or an error that tells what is missing.

    A name that is given is meant: its column has to be there, and the form has to have it. So the restitution may be
    missing only where no column was named for it.
    """
    columns = {key: set(form.columns) for key, form in among.items()}
    there = {key: {c for c in columns[key] if called.get(c, c) in names} for key in among}
    missing = {
        key: [called.get(c, c) for c in form.columns if c not in there[key] and (c != _E or c in called)]
        for key, form in among.items()
    }
    meant = [key for key in among if set(called) <= {*among[key].columns, *among[key].outputs}]
    complete = [key for key in meant if not missing[key]]
    # Where a column is there that only the larger of two forms has, and was not named for another, that one is meant:
    # pairs in space whose nz is misspelt have all columns of the plane, and in polar form without phi all of the line.
    own = {key: there[key] - {*called.values()} for key in meant}
    chosen = [key for key in complete if not any(columns[key] < columns[g] and own[g] - columns[key] for g in meant)]
    if not chosen:
        asked = "".join(f'; form="{key}" (--form {key}) takes the columns of that form alone' for key in complete)
        likely = _likely(names, called, {key: among[key] for key in meant or among})
        wanted = {c: called.get(c, c) for c in among[likely].columns if called.get(c, c) in missing[likely]}
        raise TableError(
            f"missing column {', '.join(missing[likely])} (of the {likely} form){asked}; "
            f"{advice.what_is_there(names, wanted)}"
        )
    if len(chosen) > 1:
        raise TableError(f"has the columns of more than one form: {', '.join(complete)}; `form` (--form) says which")
    return among[chosen[0]]


def _likely(names: Sequence[str], called: Mapping[str, str], among: Mapping[str, Form]) -> str:
    """The form that fits best, also where names are only nearly those of its columns, or are not there at all."""
    parts, _ = advice.parts_of(names)
    if advice.are_numbers(parts):
        return min(among, key=lambda key: abs(len(among[key].columns) - 1 - len(parts)))
    wanted = {key: [called.get(c, c) for c in form.columns if c != _E] for key, form in among.items()}
    near = {key: len(advice.nearly(wanted[key], parts)) for key in among}
    return max(among, key=lambda key: (near[key], near[key] - len(wanted[key])))


def results_of(
    columns: Columns, arrays: Mapping[str, Array], options: Options
) -> tuple[tuple[Any, ...], Sequence[Array], InvalidPairError | None]:
    """The inputs of the form in order, the results, and what tells of invalid pairs, if there are any."""
    e = options.restitution
    given = {_E: 1.0 if e is None else e, **arrays}
    inputs = tuple(given[c] for c in columns.form.columns)
    return inputs, *execution.attempt(columns.form, inputs, options.approaching_only, options.invalid, None)

"""Where columns of a form are missing: what is there instead, as what it may be meant, and what to do."""

from __future__ import annotations

import reprlib
import shlex
from collections.abc import Mapping, Sequence

_MOST = 12  # names that are listed
# That part names, how they are called, and what to say to the command line.
_MARKS = {
    ";": ("';'", "--delimiter ';'"),
    "\t": ("tab", "--delimiter tab"),
    "|": ("'|'", "--delimiter '|'"),
    ",": ("','", "--from csv, without --delimiter"),
    " ": ("' '", "--delimiter ' '"),
}


def parts_of(names: Sequence[str]) -> tuple[list[str], str]:
    """The names, or what a mark parts the only one into, and that mark or nothing."""
    mark = next((mark for mark in _MARKS if len(names) == 1 and mark in names[0]), "")
    return (names[0].split(mark) if mark else list(names)), mark


def are_numbers(names: Sequence[str]) -> bool:
    """Whether these are values, so that the line of names is missing above them."""
    try:
        return [*map(float, names)] != []
    except ValueError:
        return False


def nearly(wanted: Sequence[str], names: Sequence[str]) -> dict[str, str]:
    """Of the wanted names, those that are there with spaces, quotes or # around them, or in other letters."""
    there = {_plain(name): name for name in names}
    return {name: there[_plain(name)] for name in wanted if _plain(name) in there}


def _plain(name: str) -> str:
    return name.strip(" \t\"'#").casefold()


def what_is_there(names: Sequence[str], wanted: Mapping[str, str]) -> str:
    """The names, not too many, and what to do. `wanted`: how the missing columns are called, by what they are."""
    if not names:
        return "there is no column"
    parts, mark = parts_of(names)
    listed = ", ".join(map(_shown, names[:_MOST])) + (f" and {len(names) - _MOST} more" if names[_MOST:] else "")
    return f"there {'is' if len(names) == 1 else 'are'} {listed}: {_advice(parts, mark, wanted)}"


def _advice(parts: Sequence[str], mark: str, wanted: Mapping[str, str]) -> str:
    lines = "is the line of names missing above it?"
    if mark:
        called, option = _MARKS[mark]
        splits = f"{called} seems to part the names ({option})"
        return f"{splits}; as they are numbers, {lines}" if are_numbers(parts) else splits
    if are_numbers(parts):
        return f"these are numbers; {lines}"
    near = nearly([*wanted.values()], parts)
    others = {c: near[name] for c, name in wanted.items() if "," not in near.get(name, ",")}
    option = ",".join(f"{c}={name}" for c, name in others.items()) or f"{next(iter(wanted))}=NAME"
    return f"`columns` says which is which (--columns {shlex.quote(option)})"


def _shown(name: str) -> str:
    return name if name.isidentifier() else reprlib.repr(name)

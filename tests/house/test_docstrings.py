"""The public docstrings: in numpydoc's form, and what functions share is said in the same words."""

import collections
import importlib
import inspect
import operator
import re

import jedi
import pytest
from numpydoc.docscrape import ClassDoc, FunctionDoc
from numpydoc.validate import validate

import collide

DOORS = {
    "": [name for name in collide.__all__ if callable(getattr(collide, name))],
    "scalar.": collide.scalar.__all__,
    "arrow.": collide.arrow.__all__,
    "dask.": collide.dask.__all__,
    "errors.": ["InvalidPairError"],
}
PUBLIC = [door + name for door, names in DOORS.items() for name in names]
# Names of arguments begin in small letters; not every function has another like it, or more to say than its summary.
NOT_ASKED = {"ES01", "PR08", "SA01"}


def item(name):
    return operator.attrgetter(name)(collide)


@pytest.mark.parametrize("name", PUBLIC)
def test_numpydoc_finds_nothing(name):
    found = validate(f"collide.{name}")["errors"]
    assert [error for error in found if error[0] not in NOT_ASKED] == []


@pytest.mark.parametrize("name", PUBLIC)
def test_editors_that_read_the_source_show_every_argument(name):
    module = f"collide.{name}".rpartition(".")[0]
    (found,) = jedi.Script(f"import {module}\ncollide.{name}").help(2, len(f"collide.{name}"))
    shown = found.docstring(raw=True)
    assert shown == inspect.getdoc(item(name))
    documented = [argument for entry in doc_of(name)["Parameters"] for argument in entry.name.split(", ")]
    assert documented == list(inspect.signature(item(name)).parameters)


@pytest.mark.parametrize("door", [door for door in DOORS if door not in ("", "errors.")])
def test_what_dir_of_a_door_shows_is_public(door):
    assert dir(importlib.import_module(f"collide.{door[:-1]}")) == sorted(DOORS[door])


def doc_of(name):
    return (ClassDoc if inspect.isclass(item(name)) else FunctionDoc)(item(name))


def of_all_doors(*names):
    return [door + name for name in names for door in ("", "scalar.", "dask.") if name in DOORS[door]]


COLLISIONS = of_all_doors(
    "resolve_1d", "resolve_2d", "resolve_3d", "resolve", "resolve_polar", "impulse_2d", "impulse_3d"
)
IMPACTS = of_all_doors("time_of_impact", "time_of_impact_3d")
STATES = ["find_contacts", "resolve_contacts", "resolve_pairs", "resolve_walls"]
# By how many functions an argument, an error or a note has to be put in the same words: those that may differ in one,
# as vectors do from columns, come after.
SHARED = {
    "m1, m2": [20],
    "restitution": [20],
    "v1, v2": [3, 2],
    "v1x, v1y, v2x, v2y": [6],
    "v1x, v1y, v1z, v2x, v2y, v2z": [6],
    "nx, ny": [6],
    "nx, ny, nz": [6],
    "v1, theta1, v2, theta2": [3],
    "phi": [3],
    "dx, dy": [3],
    "dx, dy, dz": [3],
    "distance": [6],
    "InvalidPairError, collide": [8, 1],
    "ValueError, collide": [8, 1],
    "TypeError, collide": [9],
    "numba.TypingError, scalar": [8],
    "InvalidPairError, dask": [9],
    "ValueError, dask": [9],
    "TypeError, dask": [9],
    "Notes, collide": [8, 1],
    "Notes, scalar": [6, 1, 1],
    "Notes, dask": [5, 4],
}


def test_what_functions_share_is_said_in_the_same_words():
    said: dict[str, collections.Counter[str]] = collections.defaultdict(collections.Counter)
    for name in COLLISIONS + IMPACTS:
        doc, door = doc_of(name), name.rpartition(".")[0] or "collide"
        for argument in doc["Parameters"]:
            said[argument.name][" ".join(argument.desc)] += 1
        for error in doc["Raises"]:
            said[f"{error.type}, {door}"][" ".join(error.desc).replace("or doubled ", "")] += 1
        # What comes then is the bound on the error, or what it is to approach.
        said[f"Notes, {door}"][re.split(r" An? (?:velocity|impulse|time)|, and one", " ".join(doc["Notes"]))[0]] += 1
    for what, numbers in SHARED.items():
        assert sorted(said[what].values(), reverse=True) == numbers, said[what]


def test_what_compiles_says_so_in_the_same_words():
    functions = [name for name in COLLISIONS + IMPACTS if "." not in name] + STATES
    (said,) = {"\n".join(doc_of(name)["Notes"]).rpartition("\n\n")[2] for name in functions}
    assert "The first call compiles" in said and "collide compile" in said

"""The public docstrings: in numpydoc's form, and what functions share is said in the same words."""

import collections
import inspect

import jedi
import pytest
from numpydoc.docscrape import FunctionDoc
from numpydoc.validate import validate

import collide

FUNCTIONS = [name for name in collide.__all__ if inspect.isfunction(getattr(collide, name))]
# Names of arguments begin in small letters; not every function has another like it, or more to say than its summary.
NOT_ASKED = {"ES01", "PR08", "SA01"}


@pytest.mark.parametrize("name", FUNCTIONS)
def test_numpydoc_finds_nothing(name):
    found = validate(f"collide.{name}")["errors"]
    assert [error for error in found if error[0] not in NOT_ASKED] == []


@pytest.mark.parametrize("name", FUNCTIONS)
def test_editors_that_read_the_source_show_every_argument(name):
    (found,) = jedi.Script(f"import collide\ncollide.{name}").help(2, len(f"collide.{name}"))
    shown = found.docstring(raw=True)
    assert shown == inspect.getdoc(getattr(collide, name))
    assert [
        argument for argument in inspect.signature(getattr(collide, name)).parameters if argument not in shown
    ] == []


def test_what_functions_share_is_said_in_the_same_words():
    said = collections.defaultdict(lambda: collections.defaultdict(list))
    for name in ("resolve_1d", "resolve_2d", "resolve_3d", "resolve_polar", "impulse_2d", "impulse_3d"):
        doc = FunctionDoc(getattr(collide, name))
        for argument in doc["Parameters"]:
            said[argument.name][" ".join(argument.desc)].append(name)
        for error in doc["Raises"]:
            said[error.type][" ".join(error.desc).replace("or doubled ", "")].append(name)
        said["Notes"][" ".join(doc["Notes"]).partition(" A velocity")[0].partition(" An impulse")[0]].append(name)
    for shared in ("m1, m2", "restitution", "v1x, v1y, v2x, v2y", "nx, ny", "nx, ny, nz", "ValueError", "Notes"):
        assert len(said[shared]) == 1, said[shared]
    assert len(said["restitution"].popitem()[1]) == 6

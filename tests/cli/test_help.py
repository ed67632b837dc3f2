"""What the command line says of itself: examples that work, and after a wrong one where help is."""

import re

import pytest

import collide
from collide import __main__
from collide._cli import demo
from tests.helpers.tables import LINE, read, status, write

EXAMPLES = [line.split("   ")[0].split() for line in __main__._EXAMPLES.splitlines()[1:]]


@pytest.mark.fast
@pytest.mark.parametrize(
    ("arguments", "whose"),
    [
        ([], "collide"),
        (["collide"], "collide"),
        (["resolve", "in.npz"], "collide resolve"),
        (["resolve", "in.npz", "-o", "out.npz", "--fast"], "collide"),
        (["demo", "5"], "collide"),
        (["compile", "--only", "contacts"], "collide"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else None,
)
def test_wrong_usage_says_where_help_is(arguments, whose, capsys):
    assert status(*arguments) == 2
    last = capsys.readouterr().err.splitlines()[-1]
    assert re.fullmatch(rf"{whose}: error: .+; {whose} --help shows what there is", last)
    assert status(*whose.split()[1:], "--help") == 0
    assert f"usage: {whose} [-h]" in capsys.readouterr().out


@pytest.mark.fast
def test_help_has_two_examples(capsys):
    assert len(EXAMPLES) == 2
    assert status("--help") == 0
    said = capsys.readouterr().out
    assert __main__._EXAMPLES in said
    assert all(word in said for word in ("resolve", "demo", "compile", "bench", "--version"))


def test_the_examples_of_help_work(tmp_path, monkeypatch):
    ran = []
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(demo, "main", lambda: ran.append("demo"))
    write(tmp_path / "pairs.csv", LINE)
    for command, *arguments in EXAMPLES:
        assert command == "collide"
        assert status(*arguments) == 0
    assert ran == ["demo"]
    after = read(tmp_path / "after.parquet")
    assert after["u1"].to_numpy().tolist() == collide.resolve_1d(**LINE).u1.tolist()

"""The line on a terminal that says what is being done."""

import io
import sys

import pytest

from collide._cli.status_line import status_line

pytestmark = pytest.mark.fast


class Terminal(io.StringIO):
    """What stands in the last line, as a reader sees it."""

    def isatty(self):
        return True

    def line(self):
        seen: list[str] = []
        place = 0
        for character in self.getvalue():
            if character == "\r":
                place = 0
            else:
                seen[place : place + 1] = [character]
                place += 1
        return "".join(seen).rstrip(), place


@pytest.mark.parametrize("error", [None, KeyboardInterrupt])
def test_each_line_takes_the_place_of_the_one_before(error, monkeypatch):
    terminal = Terminal()
    monkeypatch.setattr(sys, "stderr", terminal)
    try:
        with status_line() as show:
            for line in ("what is long", "short", "", "again"):
                show(line)
                assert terminal.line() == (line, max(terminal.line()[1], len(line)) if line else 0)
            if error:
                raise error
    except KeyboardInterrupt:
        pass
    assert terminal.line() == ("", 0)


@pytest.mark.parametrize("stream", [None, io.StringIO()], ids=["none", "a file"])
def test_nothing_is_written_where_nobody_looks(stream, monkeypatch):
    monkeypatch.setattr(sys, "stderr", stream)
    with status_line() as show:
        show("what is being done")
    assert stream is None or stream.getvalue() == ""

"""An interrupt that comes while the package is imported ends the command in one line, and a program as it would."""

import itertools
import os
import shutil
import signal
import sys
from pathlib import Path

import pytest

import collide
from tests.helpers import process

# Of a process's own, at the moment in which something is imported.
INTERRUPTING = """
import os
import signal
import sys


class Interrupting:
    def find_spec(self, name, path=None, target=None):
        if name == os.environ["INTERRUPT_AT"]:
            os.kill(os.getpid(), signal.SIGINT)


sys.meta_path.insert(0, Interrupting())
"""


def interrupted(folder, at, *command, **options):
    (folder / "sitecustomize.py").write_text(INTERRUPTING)
    path = os.pathsep.join([str(folder), str(Path(collide.__file__).parents[1])])
    return process.run(*command, env=process.environment(PYTHONPATH=path, INTERRUPT_AT=at), **options)


COMMANDS = {
    "-m": [sys.executable, "-m", "collide"],
    "-m after options": [sys.executable, "-X", "dev", "-W", "ignore", "-Bm", "collide"],
    "-mcollide": [sys.executable, "-mcollide"],
    "script": [shutil.which("collide", path=str(Path(sys.executable).parent))],
}


PLACES = ["numpy", "llvmlite.binding", "collide.batch", "collide._tables.by_name", "pyarrow.lib"]
USUAL = {*itertools.product(PLACES, ["-m"]), *itertools.product(["collide.batch"], COMMANDS)}


@pytest.mark.parametrize(
    ("at", "command"),
    [
        pytest.param(*pair, marks=() if pair in USUAL else pytest.mark.campaign)
        for pair in itertools.product(PLACES, COMMANDS)
    ],
)
def test_an_interrupt_of_imports(at, command, tmp_path):
    """Whatever they make of exceptions."""
    (tmp_path / "in.csv").write_text("m1,m2,v1,v2\n1,1,1,1\n")
    arguments = ["resolve", str(tmp_path / "in.csv"), "-o", str(tmp_path / "out.csv")]
    done = interrupted(tmp_path, at, *COMMANDS[command], *arguments)
    assert (done.returncode, done.stdout, done.stderr) == (130, "", "collide: interrupted\n")
    assert not (tmp_path / "out.csv").exists()


@pytest.mark.parametrize(
    "arguments",
    [["-c", "import collide", "-m", "collide"], ["-m", "collider", "collide"], ["collide.py.txt", "collide"]],
    ids=" ".join,
)
def test_an_interrupt_of_a_librarys_imports_is_the_programs(arguments, tmp_path):
    for name in ("collider.py", "collide.py.txt"):
        (tmp_path / name).write_text("import collide")
    done = interrupted(tmp_path, "numba", sys.executable, *arguments, cwd=tmp_path)
    assert done.stderr.endswith("\nKeyboardInterrupt\n")
    assert done.returncode == -signal.SIGINT


def test_a_script_of_that_name_may_import_in_a_thread(tmp_path):
    """Which may not set handlers."""
    script = tmp_path / "collide"
    script.write_text(
        "import threading\nthread = threading.Thread(target=__import__, args=['collide'])\nthread.start()"
    )
    done = process.run(sys.executable, script)
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")

"""C: the plain formula of loops.c, by cc -O3 -march=native -fopenmp."""

from __future__ import annotations

import ctypes
import functools
import shutil
import subprocess
import tempfile
from collections.abc import Sequence
from pathlib import Path

from cases import IMPACTS, Array, Call, Case

from .missing import MissingError


@functools.cache
def _library() -> ctypes.CDLL:
    compiler = shutil.which("cc")
    if compiler is None:
        raise MissingError("no C compiler (cc) was found")
    source = Path(__file__).parent / "loops.c"
    with tempfile.TemporaryDirectory() as folder:
        library = Path(folder) / "loops.so"
        flags = ["-O3", "-march=native", "-fopenmp", "-shared", "-fPIC"]
        run = subprocess.run(
            [compiler, *flags, str(source), "-o", str(library), "-lm"], capture_output=True, text=True, check=False
        )
        if run.returncode:
            raise MissingError(f"cc could not compile loops.c with OpenMP: {run.stderr.strip().splitlines()[-1]}")
        return ctypes.CDLL(str(library))


def batch(case: Case) -> Call:
    if case.form in IMPACTS:
        raise MissingError("measured on collisions only")
    function = getattr(_library(), f"resolve_{case.form}")
    pointers = [ctypes.c_void_p(a.ctypes.data) for a in (*case.columns, *case.out)]

    def call() -> Sequence[Array]:
        function(ctypes.c_long(case.n), ctypes.c_int(case.threads), *pointers)
        return case.out

    return call

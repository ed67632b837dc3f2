"""`collide compile`: all kernels of the library, made ahead and kept, so that no first call of a process compiles.

Where they are kept is said in _compile/cache.py.
"""

from __future__ import annotations

import time

from .._compile.cache import folders
from .._compile.kernel import KERNELS, Kernel
from .._tables import conservation  # noqa: F401  # has kernels as well; all others are the package's own imports
from .._tables.by_name import counted
from .status_line import status_line


def main() -> str:
    """Makes them, and says how many they are and where. OSError where one is not kept, as it then would be in vain."""
    began = time.perf_counter()
    kept_in = {}
    with status_line() as show:
        for k, kernel in enumerate(KERNELS, start=1):
            show(f"kernel {k} of {len(KERNELS)}: {kernel.name}")
            _ = kernel.compiled
            if kernel.cache.path is None:
                raise OSError(f"{place(kernel)}; NUMBA_CACHE_DIR may name a folder that can be written to")
            kept_in[str(kernel.cache.path.parent)] = True
    n_new = sum(not kernel.cache.was_kept for kernel in KERNELS)
    return (
        f"{counted(len(KERNELS), 'kernel')}, {n_new} of them compiled in {time.perf_counter() - began:.0f} s, are kept "
        f"in {' and '.join(kept_in)}"
    )


def place(kernel: Kernel) -> str:
    """Where a kernel that has been made is kept, in words."""
    if kernel.cache.path is None:
        return f"kernels cannot be kept in {' or '.join(map(str, folders()))}"
    return f"kernels are kept in {kernel.cache.path.parent}"

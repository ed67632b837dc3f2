"""Of the kernels of all forms: none is compiled where it is on disk, and none runs in the place of another."""

import ast

from tests.helpers import process

EVERY_KERNEL = """
import hashlib, sys
import numpy as np
from collide._cli.limit import LIMITS
from collide._compile.cache import DiskCache
from collide._pairs import execution
from collide._pairs.forms import COLLISIONS, FORMS
from collide._tables.conservation import Conservation

compiled, save = [], DiskCache.save_overload
DiskCache.save_overload = lambda cache, *rest: compiled.append(cache._name) or save(cache, *rest)
rng, digests = np.random.default_rng(0), {}
columns = [rng.uniform(0.5, 2.0, 100) for _ in range(2)] + [rng.uniform(-2.0, 2.0, 100) for _ in range(11)]
runs = [(kind, name, dtype) for kind in (FORMS, LIMITS) for name in FORMS for dtype in (np.float64, np.float32)]
for kind, name, dtype in runs if sys.argv[1] == "first" else runs[::-1]:
    form = kind[name]
    inputs = [c.astype(dtype) for c in columns[: len(form.columns)]]
    inputs = *inputs[:-1], abs(inputs[-1])  # the restitution, or the distance
    results = execution.call(form, inputs, False, next(iter(form.invalid)), None)
    found = [hashlib.sha256(b"".join(u.tobytes() for u in results)).hexdigest()]
    if name in COLLISIONS:
        conservation = Conservation()
        conservation.add(form, inputs, results)
        found += [conservation.momentum, conservation.energy]
    digests[kind is FORMS, name, np.dtype(dtype).name] = found
print((compiled, dict(sorted(digests.items()))))
"""


def test_nothing_is_compiled_twice():
    """The second process meets the kernels in another order: machine code of one name would be mistaken for another."""
    _, first = ast.literal_eval(process.printed_by(EVERY_KERNEL, "first", timeout=400))
    compiled, second = ast.literal_eval(process.printed_by(EVERY_KERNEL, "second", timeout=400))
    assert compiled == []
    assert first == second
    assert len({found[0] for found in first.values()}) == len(first) == 32

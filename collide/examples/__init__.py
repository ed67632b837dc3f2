"""Runnable examples: `python -m collide.examples.NAME`, each a program of its own. They need the extra `examples`.

    gas         disks in a box: Maxwell's distribution, and the pressure of an equation of state
    cooling     collisions that lose energy: Haff's law
    wake        a large disk flies through many at rest: the picture of the README
    brownian    one heavy disk among light ones: from flight to diffusion
    dsmc        a gas of millions by random collisions, in space
    galperin    two balls and a wall count the digits of pi

What they share: neighbours.py, the disks of the first four, and pictures.py.
"""

from importlib.util import find_spec

for _name in ("matplotlib", "tqdm"):
    if find_spec(_name) is None:
        raise ModuleNotFoundError(f"collide.examples needs {_name}: pip install matplotlib tqdm", name=_name)

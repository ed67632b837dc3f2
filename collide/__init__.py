"""Elastic collisions of two balls, millions at once."""

import sys

if sys.byteorder != "little" or sys.maxsize < 2**63 - 1:
    raise ImportError("collide needs a 64-bit, little-endian platform: its kernels look at the bits of a float64")

from ._starting import interruptible

with interruptible():
    from . import scalar
    from ._threads import get_num_threads, set_num_threads
    from .batch import impulse_2d, resolve_1d, resolve_2d, resolve_polar, time_of_impact
    from .contacts import find_contacts, resolve_contacts
    from .errors import InvalidPairError

__all__ = [
    "InvalidPairError",
    "find_contacts",
    "get_num_threads",
    "impulse_2d",
    "resolve_1d",
    "resolve_2d",
    "resolve_contacts",
    "resolve_polar",
    "scalar",
    "set_num_threads",
    "time_of_impact",
]

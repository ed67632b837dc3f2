"""What the library does to memory: no access beyond an array, next to nothing beside the arrays, no growth.

In processes of their own: an access beyond an array ends the process, and the peak of a process is its own.
"""

import signal

import pytest

from tests.helpers import process
from tests.helpers.sizes import sizes

GUARDED = """
import ctypes
import mmap
import sys

import numpy as np

import collide
from collide._compile import kept_memory

PAGE, libc = mmap.PAGESIZE, ctypes.CDLL(None, use_errno=True)


def guarded(size):
    '''So many bytes between two pages that must not be touched.'''
    pages = -(-size // PAGE) * PAGE
    memory = mmap.mmap(-1, pages + 2 * PAGE)
    start = ctypes.addressof(ctypes.c_char.from_buffer(memory))
    for page in (start, start + PAGE + pages):
        assert libc.mprotect(ctypes.c_void_p(page), PAGE, 0) == 0
    return np.frombuffer(memory, np.uint8)[PAGE : PAGE + pages]


def at_end(array, region):
    view = region[region.size - array.nbytes :].view(array.dtype)
    view[...] = array
    return view


def last_of_rows(array, region):
    '''As the last column of rows of two, which end where the region ends.'''
    rows = region[region.size - 2 * array.nbytes :].view(array.dtype)
    view = rows.reshape(-1, 2)[:, 1]
    view[...] = array
    return view


def first_of_rows(array, region):
    rows = region[: 2 * array.nbytes].view(array.dtype).reshape(-1, 2)
    view = rows[:, 0]
    view[...] = array
    return view


def every_third(array, region):
    '''Every third number, from the first to the last of the region.'''
    rows = region[region.size - (3 * array.size - 2) * array.itemsize :].view(array.dtype) if array.size else region[:0]
    view = rows[::3] if array.size else array
    view[...] = array
    return view


def at_start(array, region):
    view = region[: array.nbytes].view(array.dtype)
    view[...] = array
    return view


class Room:
    '''In place of the search's own: each array ends where its memory ends.'''

    def __init__(self, size):
        self.regions = []

    def take(self, n, dtype):
        size = n * np.dtype(dtype).itemsize
        region = guarded(size)
        self.regions.append(region)
        region[:] = 0xFF  # NaN, and indices that lead astray
        return region[region.size - size :].view(dtype)
"""

BATCHES = """
rng = np.random.default_rng(0)
regions = [guarded(3 * 70 * 8) for _ in range(18)]
FORMS = {
    "resolve_1d": (5, 2), "resolve_2d": (9, 4), "resolve_3d": (12, 6), "resolve_polar": (8, 4), "impulse_2d": (9, 1),
    "time_of_impact": (5, 1), "time_of_impact_3d": (7, 1)
}
dtype = np.dtype(sys.argv[1])
for name, (n_columns, n_outputs) in FORMS.items():
    print(name, flush=True)
    function, impact = getattr(collide, name), name.startswith("time")
    for n in range(71):
        columns = [rng.uniform(0.5, 2.0, n).astype(dtype) for _ in range(n_columns)]
        for scalar in (None, 0, n_columns - 1):
            for place in (at_end, at_start, last_of_rows, first_of_rows, every_third):
                given = [place(c, region) for c, region in zip(columns, regions)]
                if scalar is not None:
                    given[scalar] = 1.0
                out = tuple(place(np.zeros(n, dtype), region) for region in regions[n_columns:][:n_outputs])
                for options in ({},) if impact else ({}, {"approaching_only": True}):
                    if not impact:
                        options["restitution"] = given[-1]
                    arguments = given if impact else given[:-1]
                    copies = (a.copy() if isinstance(a, np.ndarray) else a for a in arguments)
                    want = function(*copies, **options)
                    got = function(*arguments, **options, out=out if n_outputs > 1 else out[0])
                    for g, w in zip(got if n_outputs > 1 else [got], want if n_outputs > 1 else [want]):
                        np.testing.assert_array_equal(g, w)
print("rows", flush=True)
for d in (2, 3):
    for n in range(71):
        m1, m2 = rng.uniform(0.5, 2.0, (2, n)).astype(dtype)
        rows = rng.uniform(0.5, 2.0, (3, n, d)).astype(dtype)
        for place in (at_end, at_start):
            v1, v2, normal, u1, u2 = (place(rows[k % 3].ravel(), regions[k]).reshape(n, d) for k in range(5))
            want = collide.resolve(m1, m2, *rows)
            for out in ((u1, u2), (v1, v2)):
                for g, w in zip(collide.resolve(m1, m2, v1, v2, normal, out=out), want):
                    np.testing.assert_array_equal(g, w)
print("untouched")
"""

CONTACTS = """
kept_memory.Scratch = Room
rng = np.random.default_rng(1)
for n in [*range(71), 127, 128, 129, 1000, 9000]:
    for packing in (0.02, 0.4, 1.5):
        side = max(4.5, np.sqrt(n * np.pi / packing))
        x, y = rng.uniform(0, side, (2, n))
        radius = np.where(rng.random(n) < 0.1, 1.0, 0.07)
        for box in (None, (side, side)):
            for place in (at_end, at_start):
                regions = [guarded(max(1, 8 * n)) for _ in range(6)]
                xs, ys, rs = (place(a, region) for a, region in zip((x, y, radius), regions))
                i, j = collide.find_contacts(xs, ys, rs if n % 2 else 1.0, box=box)
                vx, vy = (place(rng.normal(size=n), region) for region in regions[3:5])
                lists = [guarded(max(1, 8 * i.size)) for _ in range(3)]
                impulse = place(np.zeros(i.size), lists[2])
                collide.resolve_contacts(
                    place(i, lists[0]), place(j, lists[1]), place(rs, regions[5]), xs, ys, vx, vy, box=box,
                    impulse=impulse,
                )
                options = {"box": box, "radius": place(rs, regions[5])}
                collide.resolve_contacts(place(i, lists[0]), place(j, lists[1]), 1.0, xs, ys, vx, vy, **options)
                collide.resolve_walls(xs, ys, vx, vy, rs, (side, side), m=place(rs, regions[5]))
print("untouched")
"""

DRAWN = """
import itertools

rng = np.random.default_rng(1)
for n in [*range(2, 40), 140_000]:  # the last on all threads
    for d, dtype, place in itertools.product((2, 3), (np.float64, np.float32), (at_end, at_start)):
        i, j = rng.permutation(n)[: n // 2 * 2].reshape(2, -1)
        v, normals = rng.normal(size=d * n).astype(dtype), rng.normal(size=d * i.size)
        arrays = i, j, rng.random(n) + 0.5, np.ones(i.size), np.zeros(i.size), v, normals
        i, j, m, e, impulse, v, normals = (place(a, guarded(8 * d * n)) for a in arrays)
        collide.resolve_pairs(i, j, m, v.reshape(-1, d), normals.reshape(-1, d), restitution=e, impulse=impulse)
        columns = tuple(v.reshape(d, -1)), tuple(normals.reshape(d, -1))
        collide.resolve_pairs(i, j, m, *columns, restitution=e, impulse=impulse)
print("untouched")
"""


@pytest.mark.parametrize("dtype", ["f8", "f4"])
def test_no_batch_touches_what_lies_beside_its_arrays(dtype):
    assert process.printed_by(GUARDED + BATCHES, dtype, timeout=300).endswith("\nuntouched\n")


def test_neither_do_contacts_nor_what_they_use_on_the_way():
    assert process.printed_by(GUARDED + CONTACTS, timeout=300) == "untouched\n"


def test_neither_do_drawn_pairs():
    assert process.printed_by(GUARDED + DRAWN, timeout=300) == "untouched\n"


def test_the_guard_bites():
    code = "a = at_end(np.zeros(3), guarded(24))\nctypes.string_at(a.ctypes.data, 25)"
    assert process.python(GUARDED + code).returncode == -signal.SIGSEGV


@pytest.mark.parametrize("in_place", [True, False])
@pytest.mark.parametrize("function", ["resolve_2d", "resolve_polar"])
@sizes(usual=4_000_000, campaign=10_000_000)  # a column of the former would be 30 MiB
def test_pairs_need_no_memory_but_the_arrays(function, in_place, size):
    code = """
import resource
import sys
import numpy as np
import collide

function, n = getattr(collide, sys.argv[1]), int(sys.argv[3])
rng = np.random.default_rng(0)
columns = [rng.random(n) for _ in range(8 if sys.argv[1] == "resolve_2d" else 7)]
out = tuple(columns[2:6]) if sys.argv[2] == "True" else tuple(np.ones(n) for _ in range(4))
few = [c[:100_000].copy() for c in columns]
function(*few, out=tuple(c.copy() for c in few[:4]))  # compiled, and all threads at work
before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
function(*columns, out=out, invalid="keep")
print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before)
"""
    assert int(process.printed_by(code, function, in_place, size)) <= 20 * 1024


@sizes(usual=1000, campaign=12_000)  # rounds of nine calls
def test_small_calls_leave_nothing_behind(size):
    code = """
import gc
import resource
import sys
import tracemalloc
import numpy as np
import collide

rng = np.random.default_rng(0)
c = rng.uniform(0.5, 2.0, (11, 5))
x, y = rng.uniform(0, 5, (2, 5))
vx, vy = rng.normal(size=(2, 5))
out = tuple(np.empty(5) for _ in range(4))

def calls(times):
    for _ in range(times):
        collide.resolve_1d(*c[:4])
        collide.resolve_2d(*c[:8], out=out)
        collide.resolve_polar(*c[:7], restitution=0.5)
        collide.impulse_3d(*c, approaching_only=True)
        collide.time_of_impact(*c[:5])
        collide.resolve_2d(*c[:7], c[7].astype(np.float32), invalid="nan")
        i, j = collide.find_contacts(x, y, 1.0)
        collide.resolve_contacts(i, j, 1.0, x, y, vx, vy)
        collide.resolve_pairs([0, 1], [1, 2], x, (vx, vy), c[:2, :2])
        try:
            collide.resolve_1d(-1.0, *c[1:4])
        except collide.InvalidPairError:
            pass

calls(500)
tracemalloc.start()
calls(100)
gc.collect()
before = tracemalloc.get_traced_memory()[0]
calls(int(sys.argv[1]) // 4)
gc.collect()
grown = tracemalloc.get_traced_memory()[0] - before
tracemalloc.stop()
peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
calls(int(sys.argv[1]) // 4 * 3)
print(grown, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - peak)
"""
    grown, peak = map(int, process.printed_by(code, size, timeout=300).split())
    assert grown < 60_000  # bytes: the caches of NumPy fill up to 40,000 in the end, and no more
    assert peak < 2048  # KiB

"""Interrupts, signal handlers and finalizers come between any two steps of a call: nothing hangs, breaks or is kept.

Where they come is left to chance, so each test lets many come, in a process of its own that ends itself if it hangs.
"""

import pytest

from tests.helpers import process
from tests.helpers.sizes import sizes

# Ends itself, and says where it was, if a call should never return. Ball 1 rebounds from a heavier one at rest.
START = """
import faulthandler
import random
import signal
import sys
import threading
import time

faulthandler.dump_traceback_later(100, exit=True)

import numpy as np

import collide
from collide._compile import team

random.seed(int(sys.argv[1]))
collide.set_num_threads(4)
n = 1 << 16
m1, m2, v1, v2 = np.full(n, 1.0), np.full(n, 3.0), np.full(n, 4.0), np.zeros(n)


def right():
    u = collide.resolve_1d(m1, m2, v1, v2)
    return bool((u.u1 == -2.0).all() and (u.u2 == 2.0).all())


def in_a_call(frame):
    # Elsewhere an interrupt would hit the steps of the test itself.
    while frame and not frame.f_code.co_filename.startswith(collide.__path__[0]):
        frame = frame.f_back
    return frame is not None
"""


def printed_by(code, seed=0, **variables):
    return process.printed_by(START + code, seed, env=process.environment(**variables))


# Many short calls, so that each step of handing out is hit; and long ones, which are still waiting for their workers
# when the next interrupts come. Integers pass through blocks, in Python's steps.
@pytest.mark.parametrize(("interrupts", "bits", "kind"), [(1, 16, "f8"), (1, 16, "i4"), (2, 21, "i4"), (5, 21, "i4")])
@sizes(usual=30, campaign=400)
def test_an_interrupted_call_leaves_its_arrays_alone(interrupts, bits, kind, size):
    code = f"""
left, n = 0, 1 << {bits}
m1, m2, v1, v2 = np.full(n, 1.0, "{kind}"), np.full(n, 3.0), np.full(n, 4.0), np.zeros(n)

def interrupt(number, frame):
    global left
    if left and in_a_call(frame):
        left -= 1
        raise KeyboardInterrupt

signal.signal(signal.SIGALRM, interrupt)
out = np.zeros(n), np.zeros(n)
assert right()
hits = late = more = 0
while hits < {size} or ({interrupts} > 1 and not more and hits < 2000):  # else the later ones have tested nothing
    left = {interrupts}
    signal.setitimer(signal.ITIMER_REAL, random.uniform(1e-4, 1e-3), random.uniform(5e-5, 5e-4))
    try:
        while True:
            for u in out:
                u.fill(0.0)
            collide.resolve_1d(m1, m2, v1, v2, out=out)
    except KeyboardInterrupt:
        at_once = [u.copy() for u in out]
        signal.setitimer(signal.ITIMER_REAL, 0)
        hits += 1
        more += left < {interrupts} - 1
        time.sleep(0.0005)
        late += any((u != before).any() for u, before in zip(out, at_once, strict=True))
print(hits, late, right(), more)
"""
    hits, late, usable, more = printed_by(code, interrupts).split()
    assert int(hits) >= size
    assert (late, usable, int(more) > 0) == ("0", "True", interrupts > 1)


@pytest.mark.parametrize("kind", ["f8", "f4", "i4", ">f8"])
@sizes(usual=300, campaign=3000)
def test_no_interrupt_is_lost(kind, size):
    """Where Numba looks for a type, it would become another error, and that a sign that the arrays are unusual."""
    code = f"""
few = [np.full(3, x) for x in (1.0, 3.0, 4.0, 0.0)]
few[1] = few[1].astype("{kind}")
raised = caught = 0

def interrupt(number, frame):
    global raised
    raised += 1
    raise KeyboardInterrupt

def until_interrupted():
    # A function: in Python 3.14 a jump back at the end of a try is outside of it.
    while raised == caught:
        collide.resolve_1d(*few)

signal.signal(signal.SIGALRM, interrupt)
collide.resolve_1d(*few)
while caught < {size} and raised == caught:
    try:
        signal.setitimer(signal.ITIMER_REAL, random.uniform(1e-5, 2e-4))
        until_interrupted()
    except KeyboardInterrupt:
        caught += 1
print(raised, caught)
"""
    assert printed_by(code) == f"{size} {size}\n"


@sizes(usual=300, campaign=1500)
def test_a_signal_handler_may_call(size):
    code = f"""
answers, depth = [], 0

def handle(number, frame):
    global depth
    depth += 1
    if depth < 4:  # handlers may be interrupted in their turn
        signal.setitimer(signal.ITIMER_REAL, random.uniform(2e-4, 2e-3))
    if in_a_call(frame) and len(answers) < {size}:
        answers.append(right())
    depth -= 1
    if depth == 0:
        signal.setitimer(signal.ITIMER_REAL, random.uniform(2e-4, 2e-3))

signal.signal(signal.SIGALRM, handle)
signal.setitimer(signal.ITIMER_REAL, 1e-3)
end = time.monotonic() + 60
while len(answers) < {size} and time.monotonic() < end:
    assert right()
signal.signal(signal.SIGALRM, signal.SIG_IGN)
print(len(answers) >= {size}, all(answers), right())
"""
    assert printed_by(code) == "True True True\n"


@sizes(usual=300, campaign=1500)
def test_a_finalizer_may_call(size):
    code = f"""
import gc

answers = []

class Finalized:
    def __init__(self):
        self.me = self

    def __del__(self):
        answers.append(right())
        if random.random() < 0.3:
            collide.set_num_threads(random.randint(2, 5))

gc.set_threshold(7)
for _ in range({size}):
    Finalized()
    assert right()
end = time.monotonic() + 60
while len(answers) < {size} and time.monotonic() < end:  # a worker may be collecting
    gc.collect()
    time.sleep(0.01)
print(len(answers), all(answers), right())
"""
    assert printed_by(code) == f"{size} True True\n"


GROWTH = """
import gc
import weakref

arrays = []

def call(n=500_000):
    columns = [np.full(n, x) for x in (1.0, 3.0, 4.0, 0.0)]
    arrays.extend(map(weakref.ref, columns))
    return collide.resolve_1d(*columns)

def kept():
    gc.collect()
    time.sleep(0.1)
    return sum(array() is not None for array in arrays)
"""


@sizes(usual=30, campaign=300)
def test_nothing_is_kept_where_there_are_no_threads_to_be_had(size):
    code = f"""{GROWTH}
threading.stack_size(1 << 45)
for _ in range({size}):
    assert (call().u1 == -2.0).all()
print(kept(), threading.active_count())
threading.stack_size(0)
print((call().u1 == -2.0).all(), team._the.size)
"""
    assert printed_by(code) == "0 1\nTrue 3\n"


@sizes(usual=60, campaign=200)
def test_nothing_is_kept_of_interrupted_calls(size):
    code = f"""{GROWTH}
def interrupt(number, frame):
    if in_a_call(frame):
        raise KeyboardInterrupt

signal.signal(signal.SIGALRM, interrupt)
hits = 0
for k in range({size}):
    signal.setitimer(signal.ITIMER_REAL, random.uniform(1e-3, 5e-3), 1e-3)
    try:
        while True:
            call()
            if k % 10 == 0:
                collide.set_num_threads(2 + k // 10 % 3)
    except KeyboardInterrupt:
        signal.setitimer(signal.ITIMER_REAL, 0)
        hits += 1
print(hits, kept(), team._the.size < 20, right())
"""
    assert printed_by(code) == f"{size} 0 True True\n"


# A storm of interrupts over the first call: of compiling, or of loading what has been compiled before.
FIRST_CALL = """
hits, pause = 0, 0.01

def interrupt(number, frame):
    signal.setitimer(signal.ITIMER_REAL, max(1e-5, random.expovariate(1 / pause)))  # 0 would be the last
    if in_a_call(frame):
        raise KeyboardInterrupt

signal.signal(signal.SIGALRM, interrupt)
signal.setitimer(signal.ITIMER_REAL, pause)
end = time.monotonic() + {seconds}
while time.monotonic() < end or hits < 4:  # LLVM, which no interrupt reaches, may take most of that time
    pause = random.choice([0.001, 0.01, 0.1])
    try:
        right()
        collide.resolve_2d(v1, m1, v1, v2, v1, v2, m1, m1)
        collide.find_contacts(v1[:100], v2[:100], 1.0)
    except KeyboardInterrupt:
        hits += 1
signal.signal(signal.SIGALRM, signal.SIG_IGN)
made = collide._compile.kernel._makers
print(hits, right(), len(made) < 200, collide.resolve_2d(1.0, 1.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0)[2])
"""


@sizes(usual=1, campaign=4)
def test_interrupts_while_kernels_are_compiled(size, tmp_path):
    for seed in range(size):
        check_first_calls(seed, tmp_path / str(seed))


def check_first_calls(seed, folder):
    _, *answers = printed_by(FIRST_CALL.format(seconds=3), seed, NUMBA_CACHE_DIR=folder).split()
    assert answers == ["True", "True", "1.0"]
    # And what has been kept is whole.
    _, *answers = printed_by(FIRST_CALL.format(seconds=0.5), seed, NUMBA_CACHE_DIR=folder).split()
    assert answers == ["True", "True", "1.0"]


def test_a_program_that_is_interrupted_in_its_first_call_ends(tmp_path):
    code = """
signal.signal(signal.SIGALRM, signal.default_int_handler)
signal.setitimer(signal.ITIMER_REAL, 0.4)
right()
"""
    done = process.python(START + code, 0, env=process.environment(NUMBA_CACHE_DIR=tmp_path))
    assert done.stderr.splitlines()[-1] == "KeyboardInterrupt"
    # Python's status is that of SIGINT, unless code that Numba has executed since made it forget the interrupt.
    assert done.returncode in (1, -2)
    assert {path.suffix for path in tmp_path.rglob("*.*")} == {".nbc"}  # what was begun has been finished, and kept


def test_a_call_asks_python_for_no_types():
    """Numba takes an interrupt that comes then for arguments without a kernel, and says so in its own words."""
    code = """
import itertools
from numba.core.dispatcher import Dispatcher

asked, ask = [], Dispatcher.typeof_pyval
Dispatcher.typeof_pyval = lambda dispatcher, value: asked.append(value) or ask(dispatcher, value)
columns = m1, m2, v1, v2, v1.copy(), v2.copy(), m1.copy(), m2.copy()
for dtype, writable in itertools.product((np.float64, np.float32), (True, False)):
    arrays = [c.astype(dtype) for c in columns]
    for array in arrays:
        array.flags.writeable = writable
    calls = [
        lambda: collide.resolve_1d(*arrays[:4]),
        lambda: collide.resolve_2d(*arrays),
        lambda: collide.resolve_3d(*arrays, *arrays[:3]),
        lambda: collide.resolve_polar(*arrays[:7], invalid="keep", approaching_only=True),
        lambda: collide.time_of_impact(*arrays[:5]),
        lambda: collide.find_contacts(np.arange(100.0), np.arange(100.0), np.ones(100)),
        lambda: collide.resolve_contacts([0], [1], 1.0, [0.0, 1.0], [0.0, 0.0], np.zeros(2), np.zeros(2)),
        lambda: collide.resolve_contacts(
            [0], [1], 1.0, [0.0, 1.0], [0.0, 0.0], *np.zeros((2, 2), dtype).T, radius=[1.0, 1.0]
        ),
        lambda: collide.resolve_pairs([0], [1], arrays[0], np.zeros((arrays[0].size, 2), dtype), arrays[1][:2]),
        lambda: collide.resolve_pairs([0, 1], [1, 2], 1.0, (*np.zeros((3, 5), dtype),), (arrays[1][:2],) * 3),
        lambda: collide.resolve_walls(*arrays[:2], *np.ones((2, m1.size), dtype), 0.5, (9.0, 9.0), m=m1),
    ]
    for call in calls:
        make, collide._compile.kernel.Kernel._made = collide._compile.kernel.Kernel._made, lambda kernel: made(kernel)

        def made(kernel):
            compiled = make(kernel)
            asked.clear()
            return compiled

        call()
        assert not asked, asked
        collide._compile.kernel.Kernel._made = make
print("none")
"""
    assert printed_by(code) == "none\n"

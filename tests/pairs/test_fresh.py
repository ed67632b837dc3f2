"""Memory of results that have died serves the next ones, and nobody notices: never while anybody can look at it."""

import copy
import ctypes
import gc
import pickle
import threading
import weakref

import numpy as np
import pandas as pd
import polars as pl
import pyarrow as pa
import pytest

import collide
from collide._compile import allocator, kept_memory
from collide._system import memory
from tests.helpers import process
from tests.helpers.sizes import sizes

N = 100_000  # 800 kB a result: of what is kept


@pytest.fixture(autouse=True)
def kept():
    """All starts with nothing kept, and a limit that does not depend on the machine."""
    before = collide.get_spare_memory()
    collide.set_spare_memory(0)
    collide.set_spare_memory(1 << 28)
    yield
    collide.set_spare_memory(before)


def result(value=1.0, n=N):
    """u1 of equal masses: that is v2, the value."""
    return collide.resolve_1d(1.0, 1.0, np.zeros(n), np.full(n, value)).u1


def held():
    """How many pieces are kept, and how many bytes of them."""
    state = kept_memory._keeper().state
    pieces = state[allocator.FIRST :].reshape(-1, 3)
    pieces = pieces[pieces[:, 0] != 0]
    assert pieces[:, 1].sum() == state[allocator.KEPT]
    return len(pieces), int(pieces[:, 1].sum())


@pytest.mark.fast
def test_a_result_is_an_array_like_any_other():
    u = result(3.0)
    assert type(u) is np.ndarray and u.base is None
    assert u.flags.owndata and u.flags.writeable and u.flags.c_contiguous and u.flags.aligned
    np.testing.assert_array_equal(u, 3.0)
    for again in (copy.copy(u), copy.deepcopy(u), u.copy(), pickle.loads(pickle.dumps(u))):
        np.testing.assert_array_equal(again, u)
        assert not np.shares_memory(again, u)
    assert np.shares_memory(u, u[5:]) and weakref.ref(u)() is u
    with pytest.raises(ValueError, match="referenced"):
        view = u[:]
        u.resize(2 * N)
    del view
    u.resize(2 * N, refcheck=False)
    assert (u[:N] == 3.0).all() and (u[N:] == 0.0).all()
    u.resize(10, refcheck=False)
    assert u.tolist() == [3.0] * 10
    u.setflags(write=False)
    assert not u.flags.writeable


@pytest.mark.fast
@pytest.mark.parametrize(("function", "d"), [(collide.resolve_2d, 2), (collide.resolve_3d, 3)])
def test_what_dies_is_handed_out_again(function, d):
    def results():
        return function(*np.ones((3 * d, N)), 1.0, 0.0)

    def pages():
        return {a.ctypes.data // 4096 for a in results()}

    def near(pages, others):
        return all(any(abs(page - other) <= 1 for other in others) for page in pages)

    first, second = pages(), pages()
    assert held()[0] == 2 * d and near(second, first)
    u = results()
    assert held()[0] == 0
    del u
    assert held()[0] == 2 * d


HOLDERS = {
    "view": lambda u: u[3:],
    "view of a view": lambda u: u[::2][1:].reshape(-1, 1),
    "memoryview": memoryview,
    "bytes of a memoryview": lambda u: memoryview(u).cast("B")[8:],
    "frombuffer": lambda u: np.frombuffer(u, np.uint8),
    "DLPack": np.from_dlpack,
    "pickled buffer": lambda u: buffers_of(u),
    "closure": lambda u: lambda: u,
    "array interface": lambda u: np.asarray(
        type("Wrapped", (), {"__array_interface__": u.__array_interface__, "u": u})()
    ),
    "cycle": lambda u: cycle(u),
    "void": lambda u: u.view("V8"),
    "subclass": lambda u: u.view(type("Subclass", (np.ndarray,), {})),
    "flat": lambda u: u.flat,
    "nditer": lambda u: np.nditer(u),
}


def buffers_of(u):
    buffers: list[pickle.PickleBuffer] = []
    pickle.dumps(u, protocol=5, buffer_callback=buffers.append)
    return buffers


def cycle(u):
    loop = [u]
    loop.append(loop)
    return loop


@pytest.mark.parametrize("holder", HOLDERS)
def test_what_anybody_can_look_at_is_never_handed_out(holder):
    u = result(5.0)
    place = u.ctypes.data
    held_by = HOLDERS[holder](u)
    del u
    for value in (1.0, 2.0):
        others = [result(value) for _ in range(6)]
        assert all(abs(place - a.ctypes.data) >= N * 8 for a in others)
        del others
    looked = np.frombuffer((ctypes.c_double * N).from_address(place))
    np.testing.assert_array_equal(looked, 5.0)
    del looked, held_by
    gc.collect()


def test_columns_of_frames_and_tables():
    kinds = [
        lambda u: pd.Series(u),
        lambda u: pl.Series(u),
        lambda u: pa.array(u),
        lambda u: pd.DataFrame({"u": u}, copy=False),
    ]
    for kind in kinds:
        holder = kind(result(7.0))
        for value in (1.0, 2.0, 3.0):
            result(value)
        assert (np.asarray(holder).ravel() == 7.0).all()


@sizes(usual=400, campaign=20_000)
def test_a_storm_on_many_threads(size):
    """Threads make results, hold them, views of them and buffers for a while, and look whether all is as it was."""
    errors = []

    def work(seed):
        rng = np.random.default_rng(seed)
        holding = []
        for k in range(size):
            value, n = float(seed * 1e6 + k), int(rng.integers(20_000, 60_000))
            u = result(value, n)
            way = rng.integers(4)
            holding.append(
                (value, n, u if way == 0 else u[:] if way == 1 else memoryview(u) if way == 2 else buffers_of(u)[0])
            )
            del u
            while len(holding) > rng.integers(1, 8):
                value, n, holder = holding.pop(rng.integers(len(holding)))
                a = np.frombuffer(holder)
                if a.size != n or not (a == value).all():
                    errors.append((seed, k))

    threads = [threading.Thread(target=work, args=(seed,)) for seed in range(1, 5)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert not errors
    held()  # adds up


def test_what_is_kept_is_bounded():
    many = [result() for _ in range(40)]
    del many
    count, n_bytes = held()
    assert count == allocator.SLOTS and N * 8 * count <= n_bytes <= (N * 8 + 8192) * count
    collide.set_spare_memory(3 * (N * 8 + 8192))
    assert held()[0] == 3
    result(n=10 * N)  # more than may be kept
    assert held()[0] <= 3 and held()[1] <= collide.get_spare_memory()
    collide.set_spare_memory(0)
    assert held() == (0, 0)
    u = result()
    del u
    assert held() == (0, 0)


def test_nothing_far_too_large_is_used():
    few = result(n=20 * N)
    del few
    u = result()
    assert held()[1] > 20 * N * 8  # which lies idle rather than under a small result
    del u


def test_live_arrays_hold_little_more_than_they_need():
    for n in range(2 * N, N, -7000):
        u, other = collide.resolve_1d(1.0, 1.0, np.zeros(n), np.ones(n))
        state = (ctypes.c_int64 * 2).from_address(u.ctypes.data - allocator.HEADER)
        assert u.nbytes <= state[1] <= 1.13 * u.nbytes + 8192
        del u, other


def test_the_oldest_go_first():
    few = result(n=20 * N)
    del few
    many = [result() for _ in range(allocator.SLOTS)]
    del many
    assert held()[0] == allocator.SLOTS and held()[1] < (N * 8 + 8192) * allocator.SLOTS


def test_nothing_is_kept_where_memory_is_short(monkeypatch):
    result()
    assert held()[0] > 0
    monkeypatch.setattr(memory, "free", lambda: memory.installed() // 20)
    monkeypatch.setattr(kept_memory._keeper(), "seen", -np.inf)
    result()
    assert held() == (0, 0)
    monkeypatch.undo()
    kept_memory._keeper().seen = -np.inf
    result()
    assert held()[0] > 0


@pytest.mark.parametrize("n_bytes", [-1, 0.5, True, "1", None])
def test_how_much_is_an_integer(n_bytes):
    with pytest.raises(ValueError if n_bytes == -1 else TypeError, match=r"^n_bytes = .*: must be"):
        collide.set_spare_memory(n_bytes)


def test_results_lie_at_different_places_of_a_page():
    c = np.ones((6, N))
    u = collide.resolve_2d(*c, 1.0, 0.0)
    places = [a.ctypes.data % 4096 // 64 for a in u]
    assert len({*places, c[0].ctypes.data % 4096 // 64}) == 5
    assert len({a.ctypes.data % 64 for a in (*u, c[0])}) == 1  # whole lines are loaded and stored


def test_the_search_for_contacts_keeps_its_memory_too():
    x, y = np.random.default_rng(0).uniform(0, 300, (2, 40_000))
    found = collide.find_contacts(x, y, 1.0)
    assert found.i.flags.owndata and type(found.i) is np.ndarray
    found = collide.find_contacts(x, y, 1.0)
    before = held()
    for _ in range(3):
        found = collide.find_contacts(x, y, 1.0)
        assert held() == before != (0, 0)
    assert found.i.size > 1000


def test_the_variable_of_the_environment():
    code = "import collide; print(collide.get_spare_memory())"
    assert int(process.printed_by(code, env=process.environment(COLLIDE_SPARE_MEMORY=12345))) == 12345
    default = int(process.printed_by(code, env=process.environment(COLLIDE_SPARE_MEMORY=None)))
    assert default == memory.installed() // 16
    for wrong in ("-1", "1e9", "x"):
        done = process.python(code, env=process.environment(COLLIDE_SPARE_MEMORY=wrong))
        assert f"COLLIDE_SPARE_MEMORY = {wrong!r}: must be an integer of at least 0" in done.stderr


def test_memory_goes_back_to_the_system_on_request():
    code = """
import numpy as np, collide
from pathlib import Path

def resident():
    return int(Path("/proc/self/statm").read_text().split()[1]) * 4096

v = np.zeros(4_000_000)
collide.set_spare_memory(1 << 30)
collide.resolve_1d(1.0, 1.0, v, v)
kept = resident()
collide.set_spare_memory(0)
print(kept - resident())
"""
    assert int(process.printed_by(code)) > 60e6


def test_after_a_fork_both_go_on():
    code = """
import os
import numpy as np, collide

def result(value):
    return collide.resolve_1d(1.0, 1.0, np.zeros(100_000), np.full(100_000, value)).u1

alive = result(1.0)
result(2.0)  # and dead: kept
child = os.fork()
for k in range(200):
    u = result(float(k))
    assert (u == k).all() and (alive == 1.0).all()
if child == 0:
    os._exit(0)
print(os.waitpid(child, 0)[1])
"""
    assert process.printed_by(code, env=process.environment(PYTHONWARNINGS="ignore")) == "0\n"


def test_results_may_outlive_everything():
    """Arrays that die when the interpreter ends, in every order."""
    code = """
import atexit, builtins, sys, threading
import numpy as np, collide

def results():
    return collide.resolve_2d(*np.ones((6, 100_000)), 1.0, 0.0)

class Late:
    def __init__(self):
        self.u, self.me = results(), self

    def __del__(self):
        assert self.u[0][0] == 1.0  # NumPy's all() imports on its way, which is too late now
        self.u = None

sys.kept, builtins.kept, late, here = results(), memoryview(results()[0]), Late(), results()
collide.kept = np.kept = results()
atexit.register(lambda u=results(): print(u[0].sum()))
threading.local().u = results()
"""
    for _ in range(3):
        assert process.printed_by(code) == "100000.0\n"


def test_sizes_that_no_address_has():
    a = result()
    a.resize(10, refcheck=False)
    del a
    for n in ((2**63 - 1) // 8, 2**61 - 600, 2**50):
        u = result(3.0)
        with pytest.raises(MemoryError):
            u.resize(n, refcheck=False)
        assert (u == 3.0).all()


def test_whatever_comes_is_aligned():
    odd = np.zeros(2 * N + 1, "f4")[1:]  # 4 bytes off: its results had better not be
    u = result(2.0)
    for _ in range(3):
        t = collide.resolve_1d(1.0, 1.0, odd, odd).u1
        u.resize(u.size + N, refcheck=False)
        assert u.ctypes.data % 8 == 0 and u.flags.aligned and u[:].flags.aligned and t.flags.aligned


def test_nobody_else_is_given_memory_by_it():
    """Whatever Python runs in the middle of a call sees NumPy's own allocator, and its own context."""
    code = """
import contextvars, signal, sys, time
import numpy as np, collide
from numpy._core.multiarray import get_handler_name

var = contextvars.ContextVar("var", default="unset")
var.set("set")
seen = set()

def look(*arguments):
    seen.add((get_handler_name(), var.get()))

v = np.ones(20_000)
collide.resolve_1d(v, v, v, v)
signal.signal(signal.SIGALRM, look)
signal.setitimer(signal.ITIMER_REAL, 1e-4, 1e-4)
sys.setprofile(look)
end = time.monotonic() + 1.5
while time.monotonic() < end:
    collide.resolve_1d(v, v, v, v)
sys.setprofile(None)
signal.setitimer(signal.ITIMER_REAL, 0)
print(seen)
"""
    assert process.printed_by(code) == "{('default_allocator', 'set')}\n"


def test_there_is_one_keeper_whoever_comes_first():
    code = """
import sys, threading
import numpy as np, collide
from collide._compile import allocator, kept_memory
from collide._system import memory

sys.setswitchinterval(1e-5)
v, made = np.ones(100_000), []
init = kept_memory._Keeper.__init__
kept_memory._Keeper.__init__ = lambda self: (init(self), made.append(self))[0]
start = threading.Barrier(8)

def work():
    start.wait()
    for _ in range(5):
        collide.resolve_1d(v, v, v, v)

threads = [threading.Thread(target=work) for _ in range(8)]
[t.start() for t in threads]
[t.join() for t in threads]
kept = [int(k.state[allocator.KEPT]) for k in made]
print(sum(k > 0 for k in kept))
collide.set_spare_memory(0)
print(sum(int(k.state[allocator.KEPT]) for k in made))
"""
    assert process.printed_by(code) == "1\n0\n"


def test_where_the_system_gives_no_more_what_is_kept_goes_back():
    code = """
import resource
import numpy as np, collide

collide.set_spare_memory(1 << 40)
v = np.zeros(4_000_000)
results = [collide.resolve_1d(1.0, 1.0, v, v) for _ in range(4)]
del results  # 256 MB, kept
used = int(open("/proc/self/statm").read().split()[0]) * 4096
resource.setrlimit(resource.RLIMIT_AS, (used + 60_000_000, resource.RLIM_INFINITY))
n = 6_000_000
w = v[:1]
u = collide.time_of_impact(np.broadcast_to(w, (n,)), 1.0, 0.0, 0.0, 1.0)
print(u.size)
"""
    assert process.printed_by(code) == "6000000\n"


def test_an_allocator_of_the_users_is_theirs():
    """NumPy tells no way to set one but in C: what is asked is how it is called."""
    code = """
import numpy as np, collide
from collide._compile import allocator, kept_memory
from collide._system import memory

class Other:
    get_handler_name = staticmethod(lambda *a: "users")

kept_memory.numpy_core = Other
u = collide.resolve_1d(1.0, 1.0, np.zeros(100_000), np.ones(100_000)).u1
from numpy._core.multiarray import get_handler_name
print(get_handler_name(u))
"""
    assert process.printed_by(code) == "default_allocator\n"


@pytest.mark.parametrize("text", ["99999999999999999999", "1" * 5000, "0" * 5000 + "7"])
def test_any_number_of_digits(text):
    code = "import numpy as np, collide; v = np.ones(99_999); collide.resolve_1d(v, v, v, v); "
    code += "print(collide.get_spare_memory())"
    wanted = 7 if text.endswith("7") else 1 << 60
    assert int(process.printed_by(code, env=process.environment(COLLIDE_SPARE_MEMORY=text))) == wanted

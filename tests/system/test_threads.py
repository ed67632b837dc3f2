"""A batch may be run on any number of threads, from any thread, and at any time of a process's life."""

import _thread
import functools
import threading
import time
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

import collide
from collide._system import threads as _threads
from tests.helpers import process
from tests.helpers.number_of_threads import the_number_changes

pytestmark = pytest.mark.usefixtures("keep_threads")

SIZE = 300_000  # enough for more than seven threads
PARALLEL = 3 * _threads._LEAST_SHARE  # the least that three threads share


@functools.cache
def batch(form, n=SIZE):
    """The batch function and its arguments; read-only, as several tests share them."""
    rng = np.random.default_rng(0)
    function, columns = {
        "1d": (collide.resolve_1d, 4),
        "2d": (collide.resolve_2d, 8),
        "3d": (collide.resolve_3d, 11),
        "polar": (collide.resolve_polar, 7),
    }[form]
    arguments = [rng.uniform(0.5, 2.0, n) for _ in range(columns)]
    for argument in arguments:
        argument.flags.writeable = False
    return function, arguments


def same(a, b):
    return all(x.tobytes() == y.tobytes() for x, y in zip(a, b, strict=True))


# The subprocesses' own batch: two threads, and ball 1 rebounds from a heavier one at rest.
BATCH = """
import numpy as np
import collide

collide.set_num_threads(2)
n = 400_000
m1, m2, v1, v2 = np.full(n, 1.0), np.full(n, 3.0), np.full(n, 4.0), np.zeros(n)

def right():
    u = collide.resolve_1d(m1, m2, v1, v2)
    return bool((u.u1 == -2.0).all() and (u.u2 == 2.0).all())
"""


# Results


# The larger batch is one whose outputs stream past the caches.
@pytest.mark.parametrize(("form", "n"), [*((form, SIZE) for form in ("1d", "2d", "3d", "polar")), ("1d", 1_100_003)])
def test_bits_do_not_depend_on_the_number_of_threads(form, n):
    function, arguments = batch(form, n)
    collide.set_num_threads(1)
    alone = function(*arguments)
    for threads in (2, 3, 7):
        collide.set_num_threads(threads)
        assert same(function(*arguments), alone), threads


def test_first_invalid_pair_and_their_count_do_not_depend_on_the_number_of_threads():
    function, (m1, m2, v1, v2) = batch("1d")
    v1 = v1.copy()
    for bad in ([SIZE // 3, SIZE // 2, SIZE - 1], range(7, SIZE)):
        v1[list(bad)] = -np.inf
        v1[bad[0]] = np.nan
        for threads in (1, 2, 7):
            collide.set_num_threads(threads)
            with pytest.raises(collide.InvalidPairError, match="v1 = nan") as caught:
                function(m1, m2, v1, v2)
            assert (caught.value.index, caught.value.count) == ((bad[0],), len(bad))


@pytest.mark.fast
@pytest.mark.parametrize("threads", [1, 2, 3, 7])
@pytest.mark.parametrize("n", [0, 1, PARALLEL - 1, PARALLEL, PARALLEL + 1, SIZE])
def test_shares_make_up_the_range(threads, n):
    collide.set_num_threads(threads)
    shares = _threads.run(lambda start, stop: (start, stop), n)
    assert len(shares) <= threads * _threads._SHARES_A_THREAD
    assert [start for start, _ in shares] == [0, *(stop for _, stop in shares[:-1])]
    assert shares[-1][1] == n


@pytest.mark.fast
def test_large_batch_runs_on_several_threads():
    collide.set_num_threads(3)
    together = threading.Barrier(3)
    _threads.run(lambda start, stop: together.wait(timeout=30), PARALLEL)


# Callers


def test_many_threads_may_call_while_the_number_changes():
    function, arguments = batch("1d")
    expected = function(*arguments)

    def call(_):
        return all(same(function(*arguments), expected) for _ in range(15))

    with the_number_changes(1, 2, 5), ThreadPoolExecutor(8) as callers:
        assert list(callers.map(call, range(8))) == [True] * 8


def test_threads_may_compile_at_once():
    code = f"""{BATCH}
import threading
gate, answers = threading.Barrier(4), []

def call():
    gate.wait()
    answers.append(right())

callers = [threading.Thread(target=call) for _ in range(4)]
for caller in callers:
    caller.start()
for caller in callers:
    caller.join()
print(answers)
"""
    assert process.python(code).stdout == "[True, True, True, True]\n"


def test_daemon_thread_may_call():
    function, arguments = batch("2d")
    collide.set_num_threads(2)
    expected, got = function(*arguments), []
    caller = threading.Thread(target=lambda: got.append(function(*arguments)), daemon=True)
    caller.start()
    caller.join(timeout=60)
    assert same(got[0], expected)


def test_share_may_call_in_its_turn():
    """With one worker, busy with the outer share, the inner call must not wait for it."""
    code = f"from collide._system import threads\n{BATCH}\nprint(all(threads.run(lambda start, stop: right(), n)))"
    assert process.python(code).stdout == "True\n"


def test_busy_pool_is_not_waited_for():
    collide.set_num_threads(2)
    begun, release = threading.Event(), threading.Event()

    def hold(start, stop):
        if start:
            begun.set()
        assert release.wait(timeout=30)

    holder = threading.Thread(target=_threads.run, args=(hold, PARALLEL))
    holder.start()
    try:
        assert begun.wait(timeout=30)
        assert _threads.run(lambda start, stop: (start, stop), PARALLEL)[-1][1] == PARALLEL
        assert holder.is_alive()
    finally:
        release.set()
        holder.join()


# Failures


@pytest.mark.fast
@pytest.mark.parametrize("failing", [0, 1, 2])
def test_error_in_a_share_reaches_the_caller_after_all_have_ended(failing):
    collide.set_num_threads(3)
    together, begun, ended = threading.Barrier(3), [], []

    def task(start, stop):
        begun.append(start)
        together.wait(timeout=30)
        if stop * 3 // PARALLEL == failing + 1:
            raise RuntimeError(f"share {failing}")
        time.sleep(0.2)
        ended.append(start)

    with pytest.raises(RuntimeError, match=f"share {failing}"):
        _threads.run(task, PARALLEL)
    assert (len(begun), len(ended)) == (3, 2)
    time.sleep(0.3)
    assert (len(begun), len(ended)) == (3, 2)


@pytest.mark.fast
def test_an_interrupt_withdraws_what_nobody_has_begun():
    """Else the caller would wait for the whole batch."""
    collide.set_num_threads(2)
    caller, ran = threading.current_thread(), []

    def task(start, stop):
        if threading.current_thread() is caller:
            time.sleep(0.1)  # a worker has come by then
            raise KeyboardInterrupt
        ran.append(start)
        time.sleep(0.2)

    with pytest.raises(KeyboardInterrupt):
        _threads.run(task, 8 * _threads._LEAST_SHARE)
    assert len(ran) == 1


def test_every_share_runs_once_where_no_more_threads_can_start(monkeypatch):
    """Else an in-place call resolves some pairs twice."""
    collide.set_num_threads(1)
    deadline = time.monotonic() + 30
    while _threads._workers and time.monotonic() < deadline:
        collide.set_num_threads(1)  # the workers of other tests leave
        time.sleep(0.01)
    collide.set_num_threads(3)
    start_thread, started, ran = _thread.start_new_thread, list[int](), list[int]()

    def start_one(*arguments):
        if started:
            raise RuntimeError("can't start new thread")
        started.append(start_thread(*arguments))

    def task(start, stop):
        ran.append(start)
        time.sleep(0.2)

    with monkeypatch.context() as patch:
        patch.setattr(_thread, "start_new_thread", start_one)
        _threads.run(task, PARALLEL)
    time.sleep(0.3)  # for what was left behind
    assert len(started) == 1
    assert len(ran) == len(set(ran)) == 3


# Forks and the end of the interpreter

# A child that is stuck is killed by its own alarm; status 0 is a right answer.
FORK = """
import os, signal, sys

def child():
    pid = os.fork()
    if pid == 0:
        signal.alarm(20)
        os._exit(0 if right() else 1)
    return os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1])
"""


def test_forked_child_may_call():
    done = process.python(f"{BATCH}{FORK}print(right(), child(), right(), child())")
    assert done.stdout == "True 0 True 0\n", done.stderr


def test_forked_child_has_threads_of_its_own():
    code = f"""{BATCH}{FORK}
import threading
from collide._system import threads as _threads
from tests.helpers import process
from tests.helpers.number_of_threads import the_number_changes

def right():
    together = threading.Barrier(2)
    return len(_threads.run(lambda start, stop: together.wait(timeout=10), 2 * _threads._LEAST_SHARE)) == 2

print(right(), child())
"""
    done = process.python(code)
    assert done.stdout == "True 0\n", done.stderr


def test_process_may_fork_while_another_thread_calls():
    code = f"""{BATCH}{FORK}
import threading
right()
stop = threading.Event()

def call():
    while not stop.is_set():
        right()

caller = threading.Thread(target=call)
caller.start()
print([child() for _ in range(10)])
stop.set()
caller.join()
"""
    done = process.python(code)
    assert done.stdout == f"{[0] * 10}\n", done.stderr


def test_process_may_fork_while_another_thread_compiles(tmp_path, monkeypatch):
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    code = f"""{BATCH}{FORK}
import threading, time
compiling = threading.Thread(target=right)
compiling.start()
time.sleep(0.2)
assert compiling.is_alive()
print(child())
compiling.join()
"""
    done = process.python(code)
    assert done.stdout == "0\n", done.stderr


@pytest.mark.parametrize("used", [True, False], ids=["used before", "first use"])
def test_call_at_interpreter_exit(used):
    done = process.python(f"{BATCH}import atexit; atexit.register(lambda: print(right())); {used} and right()")
    assert (done.returncode, done.stdout, done.stderr) == (0, "True\n", "")


def test_calling_daemon_thread_does_not_disturb_the_exit():
    code = f"""{BATCH}
import threading, time

def call():
    while True:
        right()

right()
threading.Thread(target=call, daemon=True).start()
time.sleep(0.2)
print("end")
"""
    done = process.python(code)
    assert (done.returncode, done.stdout, done.stderr) == (0, "end\n", "")

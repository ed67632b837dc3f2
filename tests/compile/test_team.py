"""Threads that share a kernel's range: each pair once, nobody waited for in vain, nobody at work when a call ends."""

import _thread
import contextlib
import random
import signal
import sys
import threading
import time
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from numba import types

import collide
from collide._compile import options, team
from collide._compile.arrays import address
from collide._compile.pieces import in_pieces
from collide._compile.words import add_to, pause, seen, set_to
from tests.helpers import process
from tests.helpers.number_of_threads import the_number_changes
from tests.helpers.sizes import sizes

pytestmark = pytest.mark.usefixtures("keep_threads")

N = 1 << 20
ARRAY, WORD = types.int64[::1], types.int64


def compiled(function, *arguments):
    made = options.batch_loop(function)
    made.compile(types.int64(*arguments, WORD, WORD))
    made.disable_compile()
    return lambda *given: team.together(lambda seat: made(*given, seat), given[-1])


def wait_for(threads):
    """Sets the number of threads, and waits until as many are there."""
    collide.set_num_threads(threads)
    deadline = time.monotonic() + 30
    while team._the.size < threads - 1 and time.monotonic() < deadline:
        team._the.leave(team._the.seat(N))
        time.sleep(0.001)
    assert team._the.size >= threads - 1


@options.formula
def _look(arguments):
    return 0, False


def look(marks, n, seat):  # pairs in all, and of each how often it has been taken
    return in_pieces(_look, _mark, (marks,), n, seat)


@options.formula
def _mark(start, stop, job, facts, arguments):
    (marks,) = arguments
    for i in range(start, stop):
        marks[i] += 1
    return stop - start


def meet(counter, least, n, seat):  # the pieces that have seen so many others begin
    return in_pieces(_look, _meet, (counter, least), n, seat)


@options.formula
def _meet(start, stop, job, facts, arguments):
    counter, least = arguments
    add_to(address(counter), 1)
    waited = 0
    while seen(address(counter)) < least and waited < 1_000_000_000:
        pause()
        waited += 1
    return waited < 1_000_000_000


def hold(state, n, seat):  # begun, may end, ended
    return in_pieces(_look, _hold, (state,), n, seat)


@options.formula
def _hold(start, stop, job, facts, arguments):
    (state,) = arguments
    add_to(address(state), 1)
    while seen(address(state) + 8) == 0:
        pause()
    add_to(address(state) + 16, 1)
    return 1


def write_late(values, pauses, n, seat):
    return in_pieces(_look, _write_late, (values, pauses), n, seat)


@options.formula
def _write_late(start, stop, job, facts, arguments):
    values, pauses = arguments
    for _ in range(pauses * (start // 4096 % 3)):
        pause()
    for i in range(start, stop):
        values[i] = i
    return stop - start


def count_together(total, n, seat):
    return in_pieces(_look, _count_together, (total,), n, seat)


@options.formula
def _count_together(start, stop, job, facts, arguments):
    (total,) = arguments
    for _ in range(start, stop):
        team.hold(job)
        before = seen(address(total))
        pause()
        set_to(address(total), before + 1)
        team.let_go(job)
    return 0


@pytest.fixture(scope="module")
def kernels():
    return {
        "look": compiled(look, ARRAY),
        "meet": compiled(meet, ARRAY, WORD),
        "hold": compiled(hold, ARRAY),
        "write_late": compiled(write_late, ARRAY, WORD),
        "count_together": compiled(count_together, ARRAY),
    }


@pytest.mark.parametrize("threads", [1, 2, 3, 8, 40])
@pytest.mark.parametrize("n", [0, 1, 4095, 4097, 100_003, N])
def test_each_pair_is_taken_once(kernels, threads, n):
    wait_for(threads)
    marks = np.zeros(n + 1, np.int64)
    for calls in range(1, 20):
        assert kernels["look"](marks, n) == n
        assert (marks[:n] == calls).all()
    assert marks[n] == 0


def test_all_threads_work_at_once(kernels):
    for threads in (2, 5, 9):
        wait_for(threads)
        # Each waits in its first piece for all others to come.
        assert kernels["meet"](np.zeros(1, np.int64), threads, N) > threads


def test_no_thread_is_at_work_when_a_call_ends(kernels):
    """Whether the kernel looks for it, or sleeps until the last has ended."""
    wait_for(4)
    for pauses in (0, 100, 3000, 20_000):
        for _ in range(30):
            values = np.full(60_000, -1)
            assert kernels["write_late"](values, pauses, values.size) == values.size
            assert (values == np.arange(values.size)).all()


def test_a_busy_team_is_not_waited_for(kernels):
    wait_for(3)
    state, marks = np.zeros(3, np.int64), np.zeros(N, np.int64)
    holder = threading.Thread(target=kernels["hold"], args=(state, 3 * 4096))
    holder.start()
    try:
        deadline = time.monotonic() + 30
        while state[0] < 3 and time.monotonic() < deadline:
            time.sleep(0.001)
        assert state[0] == 3
        assert kernels["look"](marks, N) == N
        assert (marks == 1).all()
        assert state[2] == 0
    finally:
        state[1] = 1
        holder.join()
    assert state[2] == 3


def test_what_threads_write_together(kernels):
    wait_for(4)
    total = np.zeros(1, np.int64)
    kernels["count_together"](total, N)
    assert total[0] == N


@sizes(usual=2000, campaign=40_000)
def test_many_callers_while_the_number_changes(kernels, size):
    """Offers that are taken back, threads that come too late, stacks that another job has by then."""

    def call(k):
        rng = np.random.default_rng(k)
        marks = np.zeros(N // 4, np.int64)
        for _ in range(size):
            n = int(rng.integers(1, 1 << int(rng.integers(1, 19))))
            assert kernels["look"](marks, n) == n
            assert (marks[:n] == 1).all()
            assert not marks[n:].any()
            marks[:n] = 0
        return True

    with the_number_changes(2, 9, 1, 4), ThreadPoolExecutor(6) as callers:
        assert list(callers.map(call, range(6))) == [True] * 6


# New teams


@pytest.fixture
def new_team(monkeypatch):
    """A function that makes one: of no thread yet. Those of old ones stay asleep."""
    monkeypatch.setattr(team, "_the", team._the)  # to come back
    before = threading.stack_size(1 << 18)
    yield lambda: monkeypatch.setattr(team, "_the", team._Team())
    threading.stack_size(before)


@sizes(usual=100, campaign=1500)
def test_callers_that_meet_at_a_new_team(kernels, new_team, size):
    interval = sys.getswitchinterval()
    sys.setswitchinterval(1e-6)
    collide.set_num_threads(3)
    meeting = threading.Barrier(3, action=new_team)

    def call(_):
        marks = np.zeros(1 << 14, np.int64)
        for calls in range(1, size + 1):
            meeting.wait(timeout=30)
            for _ in range(10):
                assert kernels["look"](marks, marks.size) == marks.size
            assert (marks == 10 * calls).all()
        return True

    try:
        with ThreadPoolExecutor(3) as callers:
            assert list(callers.map(call, range(3))) == [True] * 3
    finally:
        sys.setswitchinterval(interval)


@pytest.mark.unix
@pytest.mark.parametrize("raises", [False, True], ids=["a handler that calls", "an interrupt"])
@sizes(usual=300, campaign=3000)
def test_interrupts_while_a_team_grows(kernels, new_team, raises, size):
    if sys.platform == "win32":
        pytest.skip("Windows has no SIGALRM, which interrupts here at times that are set")
    marks, others = np.zeros(1 << 14, np.int64), np.zeros(1 << 14, np.int64)

    def interrupt(number, frame):
        if raises:
            raise KeyboardInterrupt
        kernels["look"](others, others.size)

    before = signal.signal(signal.SIGALRM, interrupt)
    collide.set_num_threads(3)
    try:
        for _ in range(size):
            new_team()
            with contextlib.suppress(KeyboardInterrupt):
                signal.setitimer(signal.ITIMER_REAL, random.uniform(1e-6, 6e-5))
                kernels["look"](marks, marks.size)
                time.sleep(1e-4)
            marks[:] = 0
            for calls in range(1, 6):
                assert kernels["look"](marks, marks.size) == marks.size
                assert (marks == calls).all()
            assert team._the._started <= 3
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)


def test_threads_that_cannot_be_started(kernels, new_team, monkeypatch):
    """They are tried again, and nothing of them stays."""
    new_team()
    collide.set_num_threads(3)
    marks, start = np.zeros(N, np.int64), team._start_thread
    monkeypatch.setattr(team, "_start_thread", lambda *arguments: team._FAILED)
    assert kernels["look"](marks, N) == N
    assert (team._the._started, team._the.size) == (0, 0)
    monkeypatch.setattr(team, "_start_thread", start)
    wait_for(3)
    assert kernels["look"](marks, N) == N
    assert (marks == 2).all()


def test_a_thread_that_has_only_just_begun_is_not_asked(kernels, new_team, monkeypatch):
    """It counts, and has no lock yet: to wake it would end the process."""
    monkeypatch.setattr(team, "_start_thread", lambda *arguments: team._FAILED)
    new_team()
    collide.set_num_threads(3)
    team._the._memory[team._BEGUN] = 2
    marks = np.zeros(N, np.int64)
    assert kernels["look"](marks, N) == N
    assert (marks == 1).all()


def test_threads_need_nothing_of_pythons(monkeypatch, new_team):
    """Where it has been replaced, as gevent does, they would keep everything else from running."""
    monkeypatch.setattr(_thread, "start_new_thread", None)
    new_team()
    wait_for(3)


@pytest.mark.parametrize("made", [True, False], ids=["made before", "made then"])
def test_a_call_by_a_finalizer_at_the_end(made):
    code = f"""
import os
import numpy as np, collide
collide.set_num_threads(4)
a = [np.full(1 << 17, x) for x in (1.0, 3.0, 4.0, 0.0)]
{made} and [collide.resolve_1d(*a) for _ in range(3)]

class Late:
    def __del__(self, call=collide.resolve_1d, a=a, write=os.write):
        u = call(*a)
        write(1, f"{{u[0][-1]}} {{u[1][0]}}".encode())

late = Late()
"""
    done = process.python(code)
    assert done.returncode == 0
    if made or done.stdout:
        assert (done.stdout, done.stderr) == ("-2.0 2.0", "")
    else:  # it needs imports, and there are none any more: an error, which Python shows, and not a wait
        assert "Exception ignored" in done.stderr

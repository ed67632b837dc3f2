"""Threads that share a kernel's range: each pair once, nobody waited for in vain, nobody at work when a call ends."""

import threading
import time
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from numba import types

import collide
from collide._compile import options, team
from collide._compile.arrays import address
from collide._compile.words import add_to, pause, seen, set_to
from tests.helpers.sizes import sizes

pytestmark = pytest.mark.usefixtures("keep_threads")

N = 1 << 20
ARRAY, WORD = types.int64[::1], types.int64


def compiled(function, *arguments):
    made = options.batch_loop(function)
    made.compile(types.int64(*arguments, WORD, WORD))
    made.disable_compile()
    return lambda *given: team.together(lambda seat: made(*given, seat))


@options.formula
def _look(first):
    return 0, False


@options.formula
def _look_at_two(first, second):
    return 0, False


def look(marks, n, seat):  # pairs in all, and of each how often it has been taken
    return team.in_pieces(_look, _mark, (marks,), n, seat)


@options.formula
def _mark(start, stop, job, facts, marks):
    for i in range(start, stop):
        marks[i] += 1
    return stop - start


def meet(counter, least, n, seat):  # the pieces that have seen so many others begin
    return team.in_pieces(_look_at_two, _meet, (counter, least), n, seat)


@options.formula
def _meet(start, stop, job, facts, counter, least):
    add_to(address(counter), 1)
    waited = 0
    while seen(address(counter)) < least and waited < 1_000_000_000:
        pause()
        waited += 1
    return waited < 1_000_000_000


def hold(state, n, seat):  # begun, may end, ended
    return team.in_pieces(_look, _hold, (state,), n, seat)


@options.formula
def _hold(start, stop, job, facts, state):
    add_to(address(state), 1)
    while seen(address(state) + 8) == 0:
        pause()
    add_to(address(state) + 16, 1)
    return 1


def write_late(values, pauses, n, seat):
    return team.in_pieces(_look_at_two, _write_late, (values, pauses), n, seat)


@options.formula
def _write_late(start, stop, job, facts, values, pauses):
    for _ in range(pauses * (start // 4096 % 3)):
        pause()
    for i in range(start, stop):
        values[i] = i
    return stop - start


def count_together(total, n, seat):
    return team.in_pieces(_look, _count_together, (total,), n, seat)


@options.formula
def _count_together(start, stop, job, facts, total):
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
    collide.set_num_threads(threads)
    marks = np.zeros(n + 1, np.int64)
    for calls in range(1, 20):
        assert kernels["look"](marks, n) == n
        assert (marks[:n] == calls).all()
    assert marks[n] == 0


def test_all_threads_work_at_once(kernels):
    for threads in (2, 5, 9):
        collide.set_num_threads(threads)
        # Each waits in its first piece for all others to come.
        assert kernels["meet"](np.zeros(1, np.int64), threads, N) > threads


def test_no_thread_is_at_work_when_a_call_ends(kernels):
    """Whether the kernel looks for it, or sleeps until the last has ended."""
    collide.set_num_threads(4)
    for pauses in (0, 100, 3000, 20_000):
        for _ in range(30):
            values = np.full(60_000, -1)
            assert kernels["write_late"](values, pauses, values.size) == values.size
            assert (values == np.arange(values.size)).all()


def test_a_busy_team_is_not_waited_for(kernels):
    collide.set_num_threads(3)
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
    collide.set_num_threads(4)
    total = np.zeros(1, np.int64)
    kernels["count_together"](total, N)
    assert total[0] == N


@sizes(usual=2000, campaign=40_000)
def test_many_callers_while_the_number_changes(kernels, size):
    """Offers that are taken back, threads that come too late, stacks that another job has by then."""
    end = threading.Event()

    def change():
        while not end.is_set():
            for threads in (2, 9, 1, 4):
                collide.set_num_threads(threads)
                time.sleep(0.0005)

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

    changing = threading.Thread(target=change)
    changing.start()
    try:
        with ThreadPoolExecutor(6) as callers:
            assert list(callers.map(call, range(6))) == [True] * 6
    finally:
        end.set()
        changing.join()

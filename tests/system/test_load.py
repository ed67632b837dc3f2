"""Under load: many threads, many processes, event loops. Each in a process of its own, with a limit on its time."""

import sys

from tests.helpers import process
from tests.helpers.sizes import sizes

# What each process runs: every function, small and large, and what it has to give.
EVERYTHING = """
import sys
import threading
import time

import numpy as np

import collide

rng = np.random.default_rng(0)
CALLS = []


def every(n):
    m1, m2, v1, v2, v1y, v2y, nx, ny, e = rng.uniform(0.5, 2.0, (9, n))
    x, y = rng.uniform(0, 2.5 * np.sqrt(n) + 1, (2, n))
    i, j = collide.find_contacts(x, y, 1.0)

    def contacts():
        vx, vy = v1.copy(), v2.copy()
        collide.resolve_contacts(i, j, m1, x, y, vx, vy)
        return vx, vy

    def drawn():
        v = np.stack([v1, v2], axis=1)
        collide.resolve_pairs(i, j, m1, v, (1.0, 0.5), invalid="keep")
        return (v,)

    def walls():
        vx, vy = v1.copy(), -v2
        collide.resolve_walls(x, y, vx, vy, 1.0, (n + 9.0, None), m=m1, restitution=e)
        return vx, vy

    return [
        lambda: collide.resolve_1d(m1, m2, v1, v2, restitution=e),
        lambda: collide.resolve_3d(m1, m2, v1, v1y, e, v2, v2y, e, nx, ny, e, approaching_only=True),
        lambda: collide.resolve_2d(*(a.astype(np.float32) for a in (m1, m2, v1, v1y, v2, v2y, nx, ny))),
        lambda: collide.resolve_polar(m1, m2, v1, nx, v2, ny, 0.3),
        lambda: [collide.impulse_3d(m1[::-1], m2, v1, v1y, e, v2, v2y, e, nx, ny, e)],
        lambda: [collide.time_of_impact_3d(x, y, e, v1, v2, e, 1.0)],
        lambda: collide.find_contacts(x, y, e),
        contacts,
        drawn,
        walls,
    ]


def right(calls):
    return all(
        all(a.tobytes() == b.tobytes() for a, b in zip(call(), want, strict=True)) for call, want in calls
    )


collide.set_num_threads(2)
for n in (1, 50, 3000, 100_000):
    CALLS += [(call, [np.array(a) for a in call()]) for call in every(n)]
"""


@sizes(usual=2, campaign=10)
def test_thirty_two_threads_call_everything_while_the_number_of_threads_changes(size):
    code = """
end, verdicts = time.monotonic() + int(sys.argv[1]), []

def work(k):
    mine = CALLS[k % 8 :] + CALLS[: k % 8]
    while time.monotonic() < end:
        for pair in mine:
            verdicts.append(right([pair]))
            if time.monotonic() > end:
                break

threads = [threading.Thread(target=work, args=(k,)) for k in range(32)]
for thread in threads:
    thread.start()
while any(thread.is_alive() for thread in threads):
    collide.set_num_threads(1 + len(verdicts) % 5)
    time.sleep(0.002)
print(all(verdicts), len(verdicts) > 32)
"""
    assert process.printed_by(EVERYTHING + code, size) == "True True\n"


def test_calls_from_pool_workers_and_event_loops():
    code = """
import asyncio
from concurrent.futures import ThreadPoolExecutor

def nested(depth):
    if depth == 0:
        return right(CALLS)
    with ThreadPoolExecutor(2) as pool:
        return all(pool.map(nested, [depth - 1] * 2)) and right(CALLS)

async def several():
    return await asyncio.gather(*(asyncio.to_thread(right, CALLS) for _ in range(8)))

print(nested(2), all(asyncio.run(several())))
"""
    assert process.printed_by(EVERYTHING + code) == "True True\n"


@sizes(usual=8, campaign=50)
def test_forked_children_after_use(size):
    code = """
import os
import warnings

warnings.simplefilter("ignore", DeprecationWarning)  # Python's own: a process with threads forks
codes = []
for k in range(int(sys.argv[1])):
    assert right(CALLS[-8:])
    child = os.fork()
    if child == 0:
        os._exit(0 if right(CALLS) else 1)
    codes.append(os.waitpid(child, 0)[1])
print(not any(codes), len(codes))
"""
    assert process.printed_by(EVERYTHING + code, size, timeout=180) == f"True {size}\n"


@sizes(usual=6, campaign=50)
def test_tasks_in_spawned_processes(size, tmp_path):
    (tmp_path / "task.py").write_text(EVERYTHING + "\n\ndef task(_):\n    return right(CALLS[:16])\n")
    code = f"""
import multiprocessing

sys.path.insert(0, {str(tmp_path)!r})
import task

if __name__ == "__main__":
    with multiprocessing.get_context("spawn").Pool(2, maxtasksperchild=5) as pool:
        print(all(pool.map(task.task, range({size}), chunksize=1)))
"""
    script = tmp_path / "main.py"
    script.write_text(EVERYTHING + code)
    done = process.run(sys.executable, script, timeout=240)
    assert (done.returncode, done.stdout, done.stderr) == (0, "True\n", "")


def test_calls_at_exit_from_every_side():
    code = """
import atexit

atexit.register(lambda: print(right(CALLS), flush=True))
daemon = threading.Thread(target=lambda: [right(CALLS) for _ in range(10_000)], daemon=True)
daemon.start()
time.sleep(0.5)
"""
    assert process.printed_by(EVERYTHING + code) == "True\n"

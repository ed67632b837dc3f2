"""Another thread that changes the number of threads while calls run."""

import contextlib
import threading
import time
from collections.abc import Iterator

import collide


@contextlib.contextmanager
def the_number_changes(*numbers: int) -> Iterator[None]:
    """To each of these in turn, again and again, half a millisecond each."""
    end = threading.Event()

    def change() -> None:
        while not end.is_set():
            for n in numbers:
                collide.set_num_threads(n)
                time.sleep(0.0005)

    changing = threading.Thread(target=change)
    changing.start()
    try:
        yield
    finally:
        end.set()
        changing.join()

"""Another thread that changes the number of threads while calls run."""

import contextlib
import threading
import time

import collide


@contextlib.contextmanager
def the_number_changes(*numbers):
    """To each of these in turn, again and again, half a millisecond each."""
    end = threading.Event()

    def change():
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

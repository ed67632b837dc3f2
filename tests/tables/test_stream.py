"""Block by block: memory does not grow with the file, and what is read ahead stays in order."""

import contextlib
import shutil
import threading
import time

import numpy as np
import pyarrow as pa
import pyarrow.csv
import pytest

from collide._tables import stream
from tests.helpers import process
from tests.helpers.tables import (
    PLANE,
    few_formats,
    write,
)

pytestmark = pytest.mark.usefixtures("small_blocks")


def big(path, n):
    """One row group, which is worst for memory. Arrow's batches have to fit into it, and are of a usual size here."""
    table = pa.table({name: np.resize(column, n) for name, column in PLANE.items()})
    if path.suffix == ".parquet":
        write(path, table, row_group_size=n, use_dictionary=False, compression="none")
    elif path.suffix in (".arrow", ".arrows", ".feather"):
        batches = table.to_batches(max_chunksize=1 << 17)
        write(path, pa.Table.from_batches(batches))
    else:
        write(path, table if path.suffix else {name: table[name].to_numpy() for name in table.column_names})


# Not getrusage: its maximum begins with that of the process that forked.
PEAK = """
import re, sys
from collide.__main__ import main
assert main(sys.argv[1:]) == 0
print(int(re.search(r"VmHWM:\\s+(\\d+) kB", open("/proc/self/status").read())[1]) // 1024)
"""


@few_formats
def test_memory_does_not_grow_with_the_file(paths):
    peaks = []
    # Of Parquet, two row groups are in memory, and no file that has fewer shows how much that is.
    sizes = {".csv": (200_000, 700_000), ".parquet": (5_000_000, 10_000_000)}
    for n in sizes.get(paths[0].suffix, (300_000, 5_000_000)):
        big(paths[0], n)
        command = "resolve", paths[0], "-o", paths[1], "--quiet", "--overwrite"
        peaks.append(int(process.printed_by(PEAK, *command, timeout=300)))
        if paths[0].is_dir():
            shutil.rmtree(paths[0])
    # The larger files are of 320 MB (CSV 100 MB, Parquet 640), their outputs of half as much again.
    assert peaks[1] < peaks[0] + 150
    assert peaks[1] < 1024


@pytest.mark.parametrize(
    ("one", "other"),
    [
        (".csv", ""),
        *(pytest.param(*pair, marks=pytest.mark.campaign) for pair in (("", ".parquet"), (".arrow", ".csv.gz"))),
        *(pytest.param(*pair, marks=pytest.mark.campaign) for pair in ((".parquet", ".tsv"), ("", ".arrows"))),
    ],
)
def test_memory_does_not_grow_with_the_file_from_one_format_to_another(one, other, tmp_path):
    peaks = []
    text = 200_000, 700_000
    sizes = {".csv": text, ".csv.gz": text, ".parquet": (3_000_000, 6_000_000)}
    for n in sizes.get(one) or sizes.get(other) or (300_000, 2_000_000):
        source = tmp_path / f"a{n}{one}"
        big(source, n)
        command = "resolve", source, "-o", tmp_path / f"b{n}{other}", "--quiet"
        peaks.append(int(process.printed_by(PEAK, *command, timeout=300)))
    assert peaks[1] < peaks[0] + 150
    assert peaks[1] < 1024


def test_memory_does_not_grow_with_what_comes_through_pipes(tmp_path):
    peaks = []
    for n in (200_000, 700_000):
        big(tmp_path / "a.csv", n)
        code = PEAK.replace("print(", "print(file=sys.stderr, *[").replace(" // 1024)", " // 1024])")
        with (tmp_path / "a.csv").open("rb") as source, (tmp_path / "b.csv").open("wb") as target:
            command = "resolve", "-", "--from", "csv", "-o", "-", "--quiet"
            peaks.append(int(process.python(code, *command, stdin=source, stdout=target).stderr))
        assert (tmp_path / "b.csv").stat().st_size > (tmp_path / "a.csv").stat().st_size
    assert peaks[1] < peaks[0] + 150
    assert peaks[1] < 1024


def test_who_waits_is_told_that_no_more_is_wanted():
    """Before the thread that waits is waited for."""
    never = threading.Event()

    def items():
        yield 1
        yield 2
        assert never.wait(30)
        yield 3

    with contextlib.closing(stream.ahead(items(), never.set)) as coming:
        assert next(coming) == 1


def test_items_are_made_ahead_in_order_in_one_thread():
    made, threads = [], set()

    def items():
        for k in range(10):
            made.append(k)
            threads.add(threading.get_ident())
            yield k

    taken = []
    for item in stream.ahead(items()):
        time.sleep(0.02)
        assert item + 1 < len(made) <= item + 4 or item >= 8  # not all of them, which would not fit
        taken.append(item)
    assert taken == list(range(10))
    assert threads.isdisjoint({threading.get_ident()})


def test_an_error_on_the_way_comes_through_after_what_was_before_it():
    def items():
        yield 1
        raise ValueError("no second")

    taken = []
    with pytest.raises(ValueError, match="no second"):
        for item in stream.ahead(items()):
            taken.append(item)
    assert taken == [1]


def test_who_stops_asking_leaves_no_thread_behind():
    before = threading.active_count()
    for item in stream.ahead(iter(range(1000))):
        if item == 3:
            break
    del item
    import gc

    gc.collect()
    assert threading.active_count() == before


def test_calls_behind_are_made_in_order_in_one_thread_and_wait_for_each_other():
    made, threads = [], set()

    def call(k):
        time.sleep(0.02)
        threads.add(threading.get_ident())
        made.append(k)

    with stream.behind(call) as again:
        for k in range(5):
            again(k)
            assert made == list(range(k))
    assert made == list(range(5))
    assert threads.isdisjoint({threading.get_ident()})
    assert len(threads) == 1


@pytest.mark.parametrize("n", [1, 2])
def test_an_error_behind_comes_to_the_next_call_or_to_the_end(n):
    def call():
        raise ValueError("wrong")

    made = []
    with pytest.raises(ValueError, match="wrong"), stream.behind(call) as again:
        for k in range(n):
            again()
            made.append(k)
    assert made == [0]

"""Files larger than memory: how `collide resolve` does beside a copy of as many bytes, and how much memory it takes.

Both read the same file and write four more columns than it has, and both end with what they wrote on the disk. The
file has COLLIDE_FILE_PAIRS pairs, 10 million unless it says otherwise: COLLIDE_FILE_PAIRS=100000000 python -m pytest
benchmarks/test_files.py -s makes files of 6.4 and 9.6 GB below the folder for temporary files. Cold is after the
system was asked to forget the input.
"""

from __future__ import annotations

import os
import re
import shutil
import statistics
import subprocess
import sys
import time

import make_pairs
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from collide.__main__ import main

N = int(os.environ.get("COLLIDE_FILE_PAIRS", "10000000"))
ROUNDS = 3
ROWS = 1 << 17
MORE = ("u1x", "u1y", "u2x", "u2y")
PEAK = """
import re, sys
from collide.__main__ import main
assert main(sys.argv[1:]) == 0
print(re.search(r"VmHWM:\\s+(\\d+) kB", open("/proc/self/status").read())[1])
"""


def copy_parquet(source, target):
    """What pyarrow alone does; four columns go out twice."""
    file = pq.ParquetFile(source)
    schema = pa.schema([*file.schema_arrow, *(pa.field(name, pa.float64()) for name in MORE)])
    with pq.ParquetWriter(target, schema, compression="none", use_dictionary=False) as writer:
        for batch in file.iter_batches(ROWS):
            writer.write_batch(pa.RecordBatch.from_arrays([*batch.columns, *batch.columns[2:6]], schema=schema))


def copy_folder(source, target):
    """Plain, a chunk of each column after the other."""
    target.mkdir()
    columns = [np.load(source / f"{name}.npy", mmap_mode="r") for name in make_pairs.NAMES]
    files = [(target / f"{name}.npy").open("wb") for name in (*make_pairs.NAMES, *MORE)]
    for start in range(0, N, ROWS):
        for column, file in zip([*columns, *columns[2:6]], files, strict=True):
            file.write(column[start : start + ROWS].data)
    for file in files:
        file.close()


def parts(path):
    return sorted(path.iterdir()) if path.is_dir() else [path]


def sync(path):
    for part in parts(path):
        handle = os.open(part, os.O_RDONLY)
        os.fsync(handle)
        os.close(handle)


def forget(path):
    sync(path)
    for part in parts(path):
        handle = os.open(part, os.O_RDONLY)
        os.posix_fadvise(handle, 0, 0, os.POSIX_FADV_DONTNEED)
        os.close(handle)


def remove(path):
    if path.is_dir():
        shutil.rmtree(path)
    else:
        path.unlink(missing_ok=True)


@pytest.fixture(scope="module", params=[".parquet", ""], ids=["Parquet", "folder"])
def source(request, tmp_path_factory):
    path = tmp_path_factory.mktemp("files") / f"pairs{request.param}"
    make_pairs.main(N, path)
    yield path
    shutil.rmtree(path.parent)


@pytest.mark.parametrize("cold", [False, True], ids=["warm", "cold"])
def test_rate(benchmark, source, cold):
    target = source.with_name(f"after{source.suffix}")
    copy = copy_folder if source.is_dir() else copy_parquet
    seconds = []

    def before():
        remove(target)
        if cold:
            forget(source)
        began = time.perf_counter()
        copy(source, target)
        sync(target)
        seconds.append(time.perf_counter() - began)
        remove(target)
        if cold:
            forget(source)

    benchmark.group = f"{N:,} pairs, {'Parquet' if source.suffix else 'a folder'}, {'cold' if cold else 'warm'}"
    arguments = ["resolve", str(source), "-o", str(target), "--quiet"]
    assert main(arguments) == 0  # compiled
    benchmark.pedantic(main, (arguments,), setup=before, rounds=ROUNDS)
    remove(target)
    ratios = [copied / resolved for copied, resolved in zip(seconds, benchmark.stats.stats.data, strict=True)]
    rate, ratio = N / statistics.median(benchmark.stats.stats.data) / 1e6, statistics.median(ratios)
    benchmark.extra_info.update(file=benchmark.group, rate=rate, copies=ratio)
    print(f"\n{benchmark.group}: {rate:.1f} M pairs/s, {ratio:.2f} times as fast as a copy", end=" ")
    assert ratio >= 0.8


def test_memory(source):
    target = source.with_name(f"after{source.suffix}")
    command = [sys.executable, "-c", PEAK, "resolve", str(source), "-o", str(target), "--quiet"]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    remove(target)
    peak = int(re.search(r"\d+", done.stdout)[0]) / 1024
    print(f"\n{N:,} pairs, {'Parquet' if source.suffix else 'a folder'}: {peak:.0f} MiB at most", end=" ")
    assert peak < 1024

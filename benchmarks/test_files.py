"""Files larger than memory: how `collide resolve` does beside what else one would use.

For a Parquet file that is the formula as an expression of Polars or DuckDB; for a folder of columns, a copy of as many
bytes. All read the same file and write four more columns than it has, and all end with what they wrote on the disk. The
file has COLLIDE_FILE_PAIRS pairs, 10 million unless it says otherwise: with 100000000 there are files of 6.4 and 9.6 GB
below the folder for temporary files. Cold is after the system was asked to forget the input.
"""

from __future__ import annotations

import duels
import pytest
from cases import FILE_PAIRS
from contestants import TABLES


@pytest.mark.parametrize("rival", TABLES)
@pytest.mark.parametrize("cold", [False, True], ids=["warm", "cold"])
def test_rate(race, benchmark, source, cold, rival):
    kind = "Parquet" if source.suffix else "a folder"
    benchmark.group = f"{FILE_PAIRS:,} pairs, {kind}, {'cold' if cold else 'warm'}"
    race(*duels.table(rival, source, cold), 3, n=FILE_PAIRS, file=benchmark.group, rival=rival)

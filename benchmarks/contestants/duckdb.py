"""DuckDB: the expression in SQL, from a Parquet file to another."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from .missing import MissingError, peer

QUERY = """
copy (
    select * exclude q, v1x - m2*q*nx u1x, v1y - m2*q*ny u1y, v2x + m1*q*nx u2x, v2y + m1*q*ny u2y
    from (
        select *, 2.0*((v1x - v2x)*nx + (v1y - v2y)*ny) / ((m1 + m2)*(nx*nx + ny*ny)) q
        from read_parquet($source)
    )
) to $target (format parquet, compression uncompressed)
"""


def table(source: Path, target: Path) -> Callable[[], None]:
    if source.suffix != ".parquet":
        raise MissingError("measured on Parquet only")
    connection = peer("duckdb").connect()
    return lambda: connection.execute(QUERY, {"source": str(source), "target": str(target)})

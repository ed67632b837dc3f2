"""Polars: the expression on a lazy frame, from a Parquet file to another in its streaming engine."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import make_pairs

from .missing import MissingError, peer
from .numpy_expression import plane


def table(source: Path, target: Path) -> Callable[[], None]:
    if source.suffix != ".parquet":
        raise MissingError("measured on Parquet only")
    pl = peer("polars")
    results = plane(*map(pl.col, make_pairs.NAMES))
    frame = pl.scan_parquet(source).with_columns(**dict(zip(make_pairs.RESULTS, results, strict=True)))
    return lambda: frame.sink_parquet(target, compression="uncompressed")

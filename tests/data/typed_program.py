"""What type checkers make of a user's program. It is checked, by mypy and basedpyright, and not run."""

from typing import assert_type

import dask.array as da
import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

import collide
from collide.batch import Velocities, Velocities1D, Velocities2D, Velocities3D

Floats = NDArray[np.floating]
Doubles = NDArray[np.float64]
Singles = NDArray[np.float32]

v: Doubles = np.ones(3)
single: Singles = np.ones(3, np.float32)
rows: Doubles = np.ones((3, 2))

assert_type(collide.resolve_1d(1.0, 2, 3.0, 4.0), Velocities1D[np.float64])
assert_type(collide.resolve_1d(1.0, 2.0, v, 0.0), Velocities1D[Floats])
assert_type(collide.resolve_1d(1.0, 2.0, [1.0, 2.0], 0.0, restitution=0.5, invalid="keep").u1, Floats)
assert_type(collide.resolve_1d(1.0, 2.0, single, 0.0, out=(single, single)), Velocities1D[Singles])
assert_type(collide.resolve_2d(1.0, 1.0, v, v, v, v, 1.0, 0.0, out=(v, v, v, v)), Velocities2D[Doubles])
results: tuple[Singles, ...] = tuple(np.empty(3, np.float32) for _ in range(4))
assert_type(collide.resolve_2d(1.0, 1.0, single, 0.0, 0.0, 0.0, 1.0, 0.0, out=results), Velocities2D[Singles])
assert_type(collide.resolve_2d(1.0, 1.0, 2.0, 0.0, 0.0, 0.0, 1.0, 0.0).u2x, np.float64)
assert_type(collide.resolve_3d(1.0, 1.0, v, v, v, v, v, v, 1.0, 0.0, 0.0), Velocities3D[Floats])
assert_type(collide.resolve_polar(1.0, 1.0, v, 0.0, v, 0.0, 1.0), Velocities2D[Floats])
assert_type(collide.resolve(1.0, 1.0, rows, rows, rows, out=(rows, rows)), Velocities[Doubles])
assert_type(collide.resolve(1.0, 1.0, rows, [0.0, 0.0], [1.0, 0.0]).u1, Floats)
assert_type(collide.impulse_2d(1.0, 1.0, v, 0.0, 0.0, 0.0, 1.0, 0.0), Floats)
assert_type(collide.impulse_3d(1.0, 1.0, 2.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0), np.float64)
assert_type(collide.time_of_impact(v, 0.0, -1.0, 0.0, 1.0, invalid="nan", out=v), Doubles)
assert_type(collide.time_of_impact_3d(3.0, 0.0, 0.0, -1.0, 0.0, 0.0, 1.0), np.float64)

i, j = collide.find_contacts(v, v, 1.0)
assert_type(i, NDArray[np.intp])
assert_type(collide.resolve_contacts(i, j, 1.0, v, v, v, v, radius=1.0), int)
assert_type(collide.resolve_pairs(i, j, 1.0, (v, v), (1.0, 0.0)), int)
assert_type(collide.get_num_threads(), int)

assert_type(collide.scalar.resolve_1d(1.0, 2, 3.0, 4.0), tuple[float, float])
assert_type(collide.scalar.resolve_3d(*(1.0,) * 11)[5], float)
assert_type(collide.scalar.impulse_2d(1.0, 1.0, 2.0, 0.0, 0.0, 0.0, 1.0, 0.0, restitution=0.5), float)
assert_type(collide.scalar.time_of_impact(np.float32(3), 0, -1.0, 0.0, np.int64(1)), float)

# To a checker that finds no types in Dask and pyarrow their arrays and tables are Any, alone and in named tuples.
lazy: da.Array = da.ones(3)
assert_type(collide.dask.resolve_2d(1.0, 1.0, lazy, 0.0, 0.0, 0.0, 1.0, 0.0), Velocities2D[da.Array])
assert_type(collide.dask.resolve_1d(1.0, 1.0, lazy, 0.0).u1, da.Array)
assert_type(collide.dask.time_of_impact(lazy, 0.0, -1.0, 0.0, 1.0, invalid="nan"), da.Array)
table: pa.Table = pa.table({"m1": v, "m2": v, "v1": v, "v2": v})
assert_type(collide.arrow.resolve(table, invalid="keep"), pa.Table)

try:
    collide.resolve_1d(-1.0, 1.0, v, v)
except collide.InvalidPairError as error:
    assert_type(error.index, tuple[int, ...])
    assert_type(error.reason, str)

# What is wrong is told: each of these is an error, and a checker complains where it is none.
collide.resolve_1d(1.0, 1.0, v, v, invalid="no")  # type: ignore[call-overload] # pyright: ignore
collide.time_of_impact(v, v, v, v, 1.0, invalid="keep")  # type: ignore[call-overload] # pyright: ignore
collide.resolve_contacts(i, j, 1.0, v, v, v, v, invalid="no")  # type: ignore[arg-type] # pyright: ignore
collide.scalar.resolve_1d(1.0, 1.0, v, 0.0)  # type: ignore[arg-type] # pyright: ignore
collide.dask.time_of_impact(lazy, 0.0, 0.0, 0.0, 1.0, invalid="keep")  # type: ignore[arg-type] # pyright: ignore
collide.arrow.resolve(table, invalid="no")  # type: ignore[arg-type] # pyright: ignore
collide.resolve_4d(v)  # type: ignore[attr-defined] # pyright: ignore

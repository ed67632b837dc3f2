"""The types of the batch functions: numbers give np.float64, `out` gives its own type, all else arrays of floats."""

from typing import Generic, NamedTuple, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray
from typing_extensions import TypeVar

from ._typing import Invalid, InvalidTime

Result = TypeVar("Result", default=NDArray[np.floating])
_Out = TypeVar("_Out", bound=NDArray[np.floating])

class Velocities1D(NamedTuple, Generic[Result]):
    u1: Result
    u2: Result

class Velocities(NamedTuple, Generic[Result]):
    u1: Result
    u2: Result

class Velocities2D(NamedTuple, Generic[Result]):
    u1x: Result
    u1y: Result
    u2x: Result
    u2y: Result

class Velocities3D(NamedTuple, Generic[Result]):
    u1x: Result
    u1y: Result
    u1z: Result
    u2x: Result
    u2y: Result
    u2z: Result

@overload
def resolve_1d(
    m1: ArrayLike,
    m2: ArrayLike,
    v1: ArrayLike,
    v2: ArrayLike,
    *,
    restitution: ArrayLike = ...,
    approaching_only: bool = ...,
    invalid: Invalid = ...,
    out: tuple[_Out, ...],
) -> Velocities1D[_Out]: ...
@overload
def resolve_1d(
    m1: float,
    m2: float,
    v1: float,
    v2: float,
    *,
    restitution: float = ...,
    approaching_only: bool = ...,
    invalid: Invalid = ...,
    out: None = ...,
) -> Velocities1D[np.float64]: ...
@overload
def resolve_1d(
    m1: ArrayLike,
    m2: ArrayLike,
    v1: ArrayLike,
    v2: ArrayLike,
    *,
    restitution: ArrayLike = ...,
    approaching_only: bool = ...,
    invalid: Invalid = ...,
    out: None = ...,
) -> Velocities1D[NDArray[np.floating]]: ...
@overload
def resolve_2d(
    m1: ArrayLike,
    m2: ArrayLike,
    v1x: ArrayLike,
    v1y: ArrayLike,
    v2x: ArrayLike,
    v2y: ArrayLike,
    nx: ArrayLike,
    ny: ArrayLike,
    *,
    restitution: ArrayLike = ...,
    approaching_only: bool = ...,
    invalid: Invalid = ...,
    out: tuple[_Out, ...],
) -> Velocities2D[_Out]: ...
@overload
def resolve_2d(
    m1: float,
    m2: float,
    v1x: float,
    v1y: float,
    v2x: float,
    v2y: float,
    nx: float,
    ny: float,
    *,
    restitution: float = ...,
    approaching_only: bool = ...,
    invalid: Invalid = ...,
    out: None = ...,
) -> Velocities2D[np.float64]: ...
@overload
def resolve_2d(
    m1: ArrayLike,
    m2: ArrayLike,
    v1x: ArrayLike,
    v1y: ArrayLike,
    v2x: ArrayLike,
    v2y: ArrayLike,
    nx: ArrayLike,
    ny: ArrayLike,
    *,
    restitution: ArrayLike = ...,
    approaching_only: bool = ...,
    invalid: Invalid = ...,
    out: None = ...,
) -> Velocities2D[NDArray[np.floating]]: ...
@overload
def resolve_3d(
    m1: ArrayLike,
    m2: ArrayLike,
    v1x: ArrayLike,
    v1y: ArrayLike,
    v1z: ArrayLike,
    v2x: ArrayLike,
    v2y: ArrayLike,
    v2z: ArrayLike,
    nx: ArrayLike,
    ny: ArrayLike,
    nz: ArrayLike,
    *,
    restitution: ArrayLike = ...,
    approaching_only: bool = ...,
    invalid: Invalid = ...,
    out: tuple[_Out, ...],
) -> Velocities3D[_Out]: ...
@overload
def resolve_3d(
    m1: float,
    m2: float,
    v1x: float,
    v1y: float,
    v1z: float,
    v2x: float,
    v2y: float,
    v2z: float,
    nx: float,
    ny: float,
    nz: float,
    *,
    restitution: float = ...,
    approaching_only: bool = ...,
    invalid: Invalid = ...,
    out: None = ...,
) -> Velocities3D[np.float64]: ...
@overload
def resolve_3d(
    m1: ArrayLike,
    m2: ArrayLike,
    v1x: ArrayLike,
    v1y: ArrayLike,
    v1z: ArrayLike,
    v2x: ArrayLike,
    v2y: ArrayLike,
    v2z: ArrayLike,
    nx: ArrayLike,
    ny: ArrayLike,
    nz: ArrayLike,
    *,
    restitution: ArrayLike = ...,
    approaching_only: bool = ...,
    invalid: Invalid = ...,
    out: None = ...,
) -> Velocities3D[NDArray[np.floating]]: ...
@overload
def resolve(
    m1: ArrayLike,
    m2: ArrayLike,
    v1: ArrayLike,
    v2: ArrayLike,
    n: ArrayLike,
    *,
    restitution: ArrayLike = ...,
    approaching_only: bool = ...,
    invalid: Invalid = ...,
    out: tuple[_Out, ...],
) -> Velocities[_Out]: ...
@overload
def resolve(
    m1: ArrayLike,
    m2: ArrayLike,
    v1: ArrayLike,
    v2: ArrayLike,
    n: ArrayLike,
    *,
    restitution: ArrayLike = ...,
    approaching_only: bool = ...,
    invalid: Invalid = ...,
    out: None = ...,
) -> Velocities[NDArray[np.floating]]: ...
@overload
def resolve_polar(
    m1: ArrayLike,
    m2: ArrayLike,
    v1: ArrayLike,
    theta1: ArrayLike,
    v2: ArrayLike,
    theta2: ArrayLike,
    phi: ArrayLike,
    *,
    restitution: ArrayLike = ...,
    approaching_only: bool = ...,
    invalid: Invalid = ...,
    out: tuple[_Out, ...],
) -> Velocities2D[_Out]: ...
@overload
def resolve_polar(
    m1: float,
    m2: float,
    v1: float,
    theta1: float,
    v2: float,
    theta2: float,
    phi: float,
    *,
    restitution: float = ...,
    approaching_only: bool = ...,
    invalid: Invalid = ...,
    out: None = ...,
) -> Velocities2D[np.float64]: ...
@overload
def resolve_polar(
    m1: ArrayLike,
    m2: ArrayLike,
    v1: ArrayLike,
    theta1: ArrayLike,
    v2: ArrayLike,
    theta2: ArrayLike,
    phi: ArrayLike,
    *,
    restitution: ArrayLike = ...,
    approaching_only: bool = ...,
    invalid: Invalid = ...,
    out: None = ...,
) -> Velocities2D[NDArray[np.floating]]: ...
@overload
def impulse_2d(
    m1: ArrayLike,
    m2: ArrayLike,
    v1x: ArrayLike,
    v1y: ArrayLike,
    v2x: ArrayLike,
    v2y: ArrayLike,
    nx: ArrayLike,
    ny: ArrayLike,
    *,
    restitution: ArrayLike = ...,
    approaching_only: bool = ...,
    invalid: Invalid = ...,
    out: _Out,
) -> _Out: ...
@overload
def impulse_2d(
    m1: float,
    m2: float,
    v1x: float,
    v1y: float,
    v2x: float,
    v2y: float,
    nx: float,
    ny: float,
    *,
    restitution: float = ...,
    approaching_only: bool = ...,
    invalid: Invalid = ...,
    out: None = ...,
) -> np.float64: ...
@overload
def impulse_2d(
    m1: ArrayLike,
    m2: ArrayLike,
    v1x: ArrayLike,
    v1y: ArrayLike,
    v2x: ArrayLike,
    v2y: ArrayLike,
    nx: ArrayLike,
    ny: ArrayLike,
    *,
    restitution: ArrayLike = ...,
    approaching_only: bool = ...,
    invalid: Invalid = ...,
    out: None = ...,
) -> NDArray[np.floating]: ...
@overload
def impulse_3d(
    m1: ArrayLike,
    m2: ArrayLike,
    v1x: ArrayLike,
    v1y: ArrayLike,
    v1z: ArrayLike,
    v2x: ArrayLike,
    v2y: ArrayLike,
    v2z: ArrayLike,
    nx: ArrayLike,
    ny: ArrayLike,
    nz: ArrayLike,
    *,
    restitution: ArrayLike = ...,
    approaching_only: bool = ...,
    invalid: Invalid = ...,
    out: _Out,
) -> _Out: ...
@overload
def impulse_3d(
    m1: float,
    m2: float,
    v1x: float,
    v1y: float,
    v1z: float,
    v2x: float,
    v2y: float,
    v2z: float,
    nx: float,
    ny: float,
    nz: float,
    *,
    restitution: float = ...,
    approaching_only: bool = ...,
    invalid: Invalid = ...,
    out: None = ...,
) -> np.float64: ...
@overload
def impulse_3d(
    m1: ArrayLike,
    m2: ArrayLike,
    v1x: ArrayLike,
    v1y: ArrayLike,
    v1z: ArrayLike,
    v2x: ArrayLike,
    v2y: ArrayLike,
    v2z: ArrayLike,
    nx: ArrayLike,
    ny: ArrayLike,
    nz: ArrayLike,
    *,
    restitution: ArrayLike = ...,
    approaching_only: bool = ...,
    invalid: Invalid = ...,
    out: None = ...,
) -> NDArray[np.floating]: ...
@overload
def time_of_impact(
    dx: ArrayLike,
    dy: ArrayLike,
    dvx: ArrayLike,
    dvy: ArrayLike,
    distance: ArrayLike,
    *,
    invalid: InvalidTime = ...,
    out: _Out,
) -> _Out: ...
@overload
def time_of_impact(
    dx: float,
    dy: float,
    dvx: float,
    dvy: float,
    distance: float,
    *,
    invalid: InvalidTime = ...,
    out: None = ...,
) -> np.float64: ...
@overload
def time_of_impact(
    dx: ArrayLike,
    dy: ArrayLike,
    dvx: ArrayLike,
    dvy: ArrayLike,
    distance: ArrayLike,
    *,
    invalid: InvalidTime = ...,
    out: None = ...,
) -> NDArray[np.floating]: ...
@overload
def time_of_impact_3d(
    dx: ArrayLike,
    dy: ArrayLike,
    dz: ArrayLike,
    dvx: ArrayLike,
    dvy: ArrayLike,
    dvz: ArrayLike,
    distance: ArrayLike,
    *,
    invalid: InvalidTime = ...,
    out: _Out,
) -> _Out: ...
@overload
def time_of_impact_3d(
    dx: float,
    dy: float,
    dz: float,
    dvx: float,
    dvy: float,
    dvz: float,
    distance: float,
    *,
    invalid: InvalidTime = ...,
    out: None = ...,
) -> np.float64: ...
@overload
def time_of_impact_3d(
    dx: ArrayLike,
    dy: ArrayLike,
    dz: ArrayLike,
    dvx: ArrayLike,
    dvy: ArrayLike,
    dvz: ArrayLike,
    distance: ArrayLike,
    *,
    invalid: InvalidTime = ...,
    out: None = ...,
) -> NDArray[np.floating]: ...

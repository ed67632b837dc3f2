"""Arguments for the collision in the plane or in space, and the textbook's vector form of it in NumPy."""

from collections.abc import Sequence
from typing import Any

import numpy as np

import collide

RESOLVE: dict[int, Any] = {2: collide.resolve_2d, 3: collide.resolve_3d}  # by the number of dimensions
SMALL, LARGE = 37, 20_011  # below and above what is copied rather than looked at for overlap; several blocks


def columns(n: int, seed: int = 0, d: int = 2) -> list[Any]:
    rng = np.random.default_rng(seed)
    return [rng.uniform(0.1, 5, n) for _ in range(2)] + [rng.uniform(-5, 5, n) for _ in range(3 * d)]


def reference(*c: Any, e: Any = 1.0) -> tuple[Any, ...]:
    """The textbook's vector form in NumPy."""
    m1, m2, *components = (np.asarray(x, np.float64) for x in c)
    d = len(components) // 3
    v1, v2, normal = components[:d], components[d : 2 * d], components[2 * d :]
    closing = sum((a - b) * n for a, b, n in zip(v1, v2, normal, strict=True))
    q = (1 + e) * closing / ((m1 + m2) * sum(n * n for n in normal))
    return tuple(v + m * q * n for vs, m in ((v1, -m2), (v2, m1)) for v, n in zip(vs, normal, strict=True))


def check(got: Sequence[Any], want: Sequence[Any], dtype: Any = np.float64, rtol: float = 1e-12) -> None:
    for u, w in zip(got, want, strict=True):
        assert u.dtype == dtype
        assert u.shape == np.shape(w)
        np.testing.assert_allclose(u, w, rtol=rtol, atol=rtol * 10)

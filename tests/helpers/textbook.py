"""Arguments for the collision in the plane, and the textbook's vector form of it in NumPy."""

import numpy as np

SMALL, LARGE = 37, 20_011  # below and above what is copied rather than looked at for overlap; several blocks


def columns(n, seed=0):
    rng = np.random.default_rng(seed)
    return [rng.uniform(0.1, 5, n) for _ in range(2)] + [rng.uniform(-5, 5, n) for _ in range(6)]


def reference(*c, e=1.0):
    """The textbook's vector form in NumPy."""
    m1, m2, v1x, v1y, v2x, v2y, nx, ny = (np.asarray(x, np.float64) for x in c)
    q = (1 + e) * ((v1x - v2x) * nx + (v1y - v2y) * ny) / ((m1 + m2) * (nx * nx + ny * ny))
    return v1x - m2 * q * nx, v1y - m2 * q * ny, v2x + m1 * q * nx, v2y + m1 * q * ny


def check(got, want, dtype=np.float64, rtol=1e-12):
    for u, w in zip(got, want, strict=True):
        assert u.dtype == dtype
        assert u.shape == np.shape(w)
        np.testing.assert_allclose(u, w, rtol=rtol, atol=rtol * 10)

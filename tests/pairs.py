"""Random pairs over the whole range of contract 1."""

import numpy as np


def cartesian(n, seed):
    """m1, m2, v1x, v1y, v2x, v2y, nx, ny, restitution."""
    rng = np.random.default_rng(seed)

    def log_uniform(low, high):
        return 10.0 ** rng.uniform(low, high, n)

    def one_of(*choices):
        return np.choose(rng.integers(len(choices), size=n), choices)

    def signed(x):
        return x * rng.choice([-1.0, 1.0], n)

    m1 = log_uniform(-300, 300)
    m2 = np.clip(one_of(log_uniform(-300, 300), m1 * log_uniform(-3, 3), m1), 1e-300, 1e300)
    special = rng.random(n)
    m1[special < 0.03], m2[(special > 0.1) & (special < 0.13)] = 0.0, 0.0
    m1[(special > 0.2) & (special < 0.23)], m2[(special > 0.3) & (special < 0.33)] = np.inf, np.inf
    speed, length = log_uniform(-150, 150), log_uniform(-300, 299)
    v = [signed(one_of(speed * rng.random(n), speed, log_uniform(-150, 150))) for _ in range(4)]
    normal = [signed(one_of(length * rng.random(n), length, log_uniform(-300, 300))) for _ in range(2)]
    axis = rng.random(n) < 0.05
    normal[0][axis] = 0.0
    return m1, m2, *v, *normal, one_of(np.ones(n), rng.random(n))


def polar(n, seed):
    """m1, m2, v1, theta1, v2, theta2, phi, restitution."""
    rng = np.random.default_rng(seed + 1)
    m1, m2, v1, _, v2, *_, e = cartesian(n, seed)

    def angle():
        small, large = rng.uniform(-7, 7, n), 10.0 ** rng.uniform(-20, 300, n)
        quarter = np.pi / 2 * rng.integers(-8, 8, n)
        return np.choose(rng.choice(3, n, p=[0.8, 0.1, 0.1]), [small, large, quarter])

    return m1, m2, v1, angle(), v2, angle(), angle(), e

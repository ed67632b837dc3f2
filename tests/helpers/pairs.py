"""Random pairs over the whole range of contract 1, of the same bits on every processor and by every build of NumPy.

What a digest is taken of is made of random integers by single operations, each rounded once, and by ldexp. NumPy's
`10.0 ** x` has other bits without AVX-512, in a twentieth of the values, and Generator.uniform where a compiler fuses
its product and sum.
"""

from typing import Any

import numpy as np

LOG2_10 = 3.321928094887362


def uniform(rng: np.random.Generator, low: float, high: float, size: Any) -> Any:
    return low + (high - low) * rng.random(size)  # random() is an integer times a power of two


def log_uniform(rng: np.random.Generator, low: float, high: float, size: Any) -> Any:
    """From 10**low to 10**high: spread evenly over the powers of two, and evenly between two of them."""
    exponent = uniform(rng, low * LOG2_10, high * LOG2_10, size)
    whole = np.floor(exponent)
    # Half way between two powers of two this is 6 % above 2**exponent: so it may overshoot the end.
    return np.minimum(np.ldexp(1.0 + (exponent - whole), whole.astype(np.int32)), float(f"1e{high}"))


def plane(n: int, seed: int) -> tuple[Any, ...]:
    """m1, m2, v1x, v1y, v2x, v2y, nx, ny, restitution."""
    rng = np.random.default_rng(seed)

    def magnitude(low: float, high: float) -> Any:
        return log_uniform(rng, low, high, n)

    def one_of(*choices: Any) -> Any:
        return np.choose(rng.integers(len(choices), size=n), choices)

    def signed(x: Any) -> Any:
        return x * rng.choice([-1.0, 1.0], n)

    m1 = magnitude(-300, 300)
    m2 = np.clip(one_of(magnitude(-300, 300), m1 * magnitude(-3, 3), m1), 1e-300, 1e300)
    special = rng.random(n)
    m1[special < 0.03], m2[(special > 0.1) & (special < 0.13)] = 0.0, 0.0
    m1[(special > 0.2) & (special < 0.23)], m2[(special > 0.3) & (special < 0.33)] = np.inf, np.inf
    speed, length = magnitude(-150, 150), magnitude(-300, 299)
    v = [signed(one_of(speed * rng.random(n), speed, magnitude(-150, 150))) for _ in range(4)]
    normal = [signed(one_of(length * rng.random(n), length, magnitude(-300, 300))) for _ in range(2)]
    axis = rng.random(n) < 0.05
    normal[0][axis] = 0.0
    return m1, m2, *v, *normal, one_of(np.ones(n), rng.random(n))


def space(n: int, seed: int) -> tuple[Any, ...]:
    """m1, m2, v1x, v1y, v1z, v2x, v2y, v2z, nx, ny, nz, restitution: the plane's, and third components like its."""
    rng = np.random.default_rng(seed + 2)
    m1, m2, v1x, v1y, v2x, v2y, nx, ny, e = plane(n, seed)

    def third(*others: Any) -> Any:
        """Of the size of one of the others, or smaller, or 0."""
        like = np.choose(rng.integers(len(others), size=n), others)
        return like * np.choose(
            rng.integers(3, size=n), [rng.choice([-1.0, 1.0], n), uniform(rng, -1, 1, n), np.zeros(n)]
        )

    v1z, v2z = third(v1x, v1y, v2x), third(v2x, v2y, v1y)
    return m1, m2, v1x, v1y, v1z, v2x, v2y, v2z, nx, ny, third(nx, ny), e


def polar(n: int, seed: int) -> tuple[Any, ...]:
    """m1, m2, v1, theta1, v2, theta2, phi, restitution."""
    rng = np.random.default_rng(seed + 1)
    m1, m2, v1, _, v2, *_, e = plane(n, seed)

    def angle() -> Any:
        small, large = uniform(rng, -7, 7, n), log_uniform(rng, -20, 300, n)
        quarter = np.pi / 2 * rng.integers(-8, 8, n)
        return np.choose(np.maximum(rng.integers(10, size=n) - 7, 0), [small, large, quarter])

    return m1, m2, v1, angle(), v2, angle(), angle(), e

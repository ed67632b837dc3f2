"""Contract 2: the same bits for the same pair whatever its neighbours, position, alignment, threads and call."""

import numba
import numpy as np
import pytest

import collide
from tests.helpers import pairs

FORMS = ["resolve_1d", "resolve_2d", "resolve_3d", "resolve_polar"]


def columns(name, n, seed=0):
    """Pairs of every size, among them walls, test particles and extreme normals; all of them valid."""
    if name == "resolve_polar":
        return pairs.polar(n, seed)
    if name == "resolve_3d":
        return pairs.space(n, seed)
    c = pairs.plane(n, seed)
    return (*c[:4], c[-1]) if name == "resolve_1d" else c


def batch(name, c, **options):
    return getattr(collide, name)(*c[:-1], restitution=c[-1], **options)


def assert_same_bits(got, want):
    for a, b in zip(got, want, strict=True):
        np.testing.assert_array_equal(np.asarray(a).view(np.int64), np.asarray(b).view(np.int64))


@pytest.mark.fast
@pytest.mark.parametrize("name", FORMS)
def test_threads(name, keep_threads):
    c = columns(name, 200_003)
    collide.set_num_threads(1)
    want = batch(name, c)
    for threads in (2, 3, 7):
        collide.set_num_threads(threads)
        assert_same_bits(batch(name, c), want)


@pytest.mark.parametrize("name", FORMS)
def test_lengths_positions_and_alignments(name):
    c = columns(name, 220)
    want = batch(name, c)
    for n in range(101):
        start = (7 * n) % 110
        part = [x[start : start + n] for x in c]  # every alignment that a double can have
        assert_same_bits(batch(name, part), [u[start : start + n] for u in want])


@pytest.mark.parametrize("name", FORMS)
@pytest.mark.parametrize("shift", range(8))
def test_alignment_of_streamed_outputs(name, shift):
    n = (1 << 20) + 5  # 8 MiB an output: streamed
    c = [np.tile(x, n // 1000 + 1)[:n] for x in columns(name, 1000)]
    want = batch(name, [x[:1000] for x in c])
    out = tuple(np.empty(n + 8)[shift : shift + n] for _ in want)
    got = batch(name, c, out=out)
    assert_same_bits([u[:1000] for u in got], want)
    assert_same_bits([u[-1000:] for u in got], [np.roll(w, -(n % 1000)) for w in want])


@pytest.mark.parametrize("name", FORMS)
def test_neighbours(name):
    """A pair beside a wall, an extreme normal, an angle of 1e300 or an invalid pair has the bits that it has alone."""
    c = columns(name, 64)
    for k in range(64):
        assert_same_bits(batch(name, [x[k : k + 1] for x in c]), [u[k : k + 1] for u in batch(name, c)])
    spoiled = [x.copy() for x in c]
    for x in spoiled[:-1]:
        x[::3] = np.nan
    valid = np.arange(64) % 3 != 0
    got = batch(name, spoiled, invalid="nan")
    assert_same_bits([u[valid] for u in got], [u[valid] for u in batch(name, c)])


@numba.njit
def one_by_one_1d(m1, m2, v1, v2, e, u1, u2):
    for k in range(m1.size):
        u1[k], u2[k] = collide.scalar.resolve_1d(m1[k], m2[k], v1[k], v2[k], e[k])


@numba.njit
def one_by_one_2d(m1, m2, v1x, v1y, v2x, v2y, nx, ny, e, u1x, u1y, u2x, u2y):
    for k in range(m1.size):
        u1x[k], u1y[k], u2x[k], u2y[k] = collide.scalar.resolve_2d(
            m1[k], m2[k], v1x[k], v1y[k], v2x[k], v2y[k], nx[k], ny[k], e[k]
        )


@numba.njit
def one_by_one_3d(m1, m2, v1x, v1y, v1z, v2x, v2y, v2z, nx, ny, nz, e, u1x, u1y, u1z, u2x, u2y, u2z):
    for k in range(m1.size):
        u1x[k], u1y[k], u1z[k], u2x[k], u2y[k], u2z[k] = collide.scalar.resolve_3d(
            m1[k], m2[k], v1x[k], v1y[k], v1z[k], v2x[k], v2y[k], v2z[k], nx[k], ny[k], nz[k], e[k]
        )


@numba.njit
def one_by_one_polar(m1, m2, v1, theta1, v2, theta2, phi, e, u1x, u1y, u2x, u2y):
    for k in range(m1.size):
        u1x[k], u1y[k], u2x[k], u2y[k] = collide.scalar.resolve_polar(
            m1[k], m2[k], v1[k], theta1[k], v2[k], theta2[k], phi[k], e[k]
        )


@pytest.mark.parametrize(
    ("name", "loop"), [*zip(FORMS, (one_by_one_1d, one_by_one_2d, one_by_one_3d, one_by_one_polar), strict=True)]
)
def test_scalar_call_in_compiled_code(name, loop):
    c = columns(name, 5000)
    want = batch(name, c)
    got = [np.empty(5000) for _ in want]
    loop(*c, *got)
    assert_same_bits(got, want)


@pytest.mark.parametrize("name", ["resolve_1d", "resolve_2d", "resolve_3d"])
def test_the_formula_on_numpy_arrays(name):
    """The oracle bit for bit: the same source, run by NumPy. In blocks, so that no neighbour hides another."""
    c = columns(name, 20_000)
    with np.errstate(all="ignore"):  # what a select throws away may have overflowed
        assert_same_bits(getattr(collide.scalar, name)(*c), batch(name, c))
        for k in range(0, 2000, 2):
            part = [x[k : k + 2] for x in c]
            assert_same_bits(getattr(collide.scalar, name)(*part), batch(name, part))


@pytest.mark.parametrize("name", FORMS)
def test_float32_is_the_float64_result_rounded_once(name):
    rng = np.random.default_rng(5)
    n_inputs = {"resolve_1d": 4, "resolve_2d": 8, "resolve_3d": 11, "resolve_polar": 7}[name]
    c = [rng.uniform(0.1, 9, 1003).astype(np.float32) for _ in range(n_inputs)]
    for e in (1.0, 0.9):
        got = getattr(collide, name)(*c, restitution=e)
        want = getattr(collide, name)(*(x.astype(np.float64) for x in c), restitution=e)
        for a, b in zip(got, want, strict=True):
            assert a.dtype == np.float32
            np.testing.assert_array_equal(a, b.astype(np.float32))


@pytest.mark.fast
def test_a_pair_in_the_plane_has_the_bits_of_the_plane_in_space():
    """But for the sign of a zero, which an added zero may turn. Its third components are zeros."""
    m1, m2, *v, nx, ny, e = pairs.plane(20_000, 6)
    nothing = np.random.default_rng(0).choice([0.0, -0.0], (3, 20_000))
    given = m1, m2, *v[:2], nothing[0], *v[2:], nothing[1], nx, ny, nothing[2]
    want, got = collide.resolve_2d(m1, m2, *v, nx, ny, restitution=e), collide.resolve_3d(*given, restitution=e)
    assert_same_bits([u + 0.0 for u in (got.u1x, got.u1y, got.u2x, got.u2y)], [u + 0.0 for u in want])
    assert not got.u1z.any() and not got.u2z.any()
    want = collide.impulse_2d(m1, m2, *v, nx, ny, restitution=e, invalid="nan")
    got = collide.impulse_3d(*given, restitution=e, invalid="nan")
    assert_same_bits([got + 0.0], [want + 0.0])

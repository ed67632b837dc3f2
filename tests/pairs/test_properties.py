"""What every collision obeys. Tolerances are k * eps * scale, k stated at each."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import collide
from tests.helpers.naive import EPS

settings.register_profile("collide", max_examples=300, deadline=None)
settings.load_profile("collide")

masses = st.floats(1e-6, 1e6)
velocities = st.floats(-1e3, 1e3).map(lambda x: 0.0 if abs(x) < 1e-6 else x)
speeds = st.floats(0, 1e3).map(lambda x: 0.0 if x < 1e-6 else x)
angles = st.floats(-7.0, 7.0)
restitutions = st.floats(0.0, 1.0)
pair = st.tuples(masses, masses, velocities, velocities, velocities, velocities, angles)


def resolve(p, **options):
    """The pair with its normal at the angle phi: (u1x, u1y, u2x, u2y) as an array, and the normal."""
    *rest, phi = p
    n = np.array([np.cos(phi), np.sin(phi)])
    return np.array(collide.resolve_2d(*rest, *n, **options)), n


def scale_of(p, u):
    return max(np.abs(p[2:6]).max(), np.abs(u).max())


def close(got, want, k, scale):
    np.testing.assert_allclose(got, want, rtol=0, atol=k * EPS * scale)


@given(pair, restitutions)
def test_momentum(p, e):
    u, _ = resolve(p, restitution=e)
    m1, m2 = p[:2]
    change = m1 * (u[:2] - p[2:4]) + m2 * (u[2:] - p[4:6])
    close(change, 0, 16, scale_of(p, u) * (m1 + m2))


@given(pair)
def test_energy_of_an_elastic_collision(p):
    u, _ = resolve(p)
    m1, m2 = p[:2]
    before = m1 * np.square(p[2:4]).sum() + m2 * np.square(p[4:6]).sum()
    after = m1 * np.square(u[:2]).sum() + m2 * np.square(u[2:]).sum()
    close(after, before, 64, (m1 + m2) * scale_of(p, u) ** 2)


@given(pair, restitutions)
def test_the_component_across_is_untouched_and_that_along_is_turned(p, e):
    """Directions: a rule that ignored the line of centres would conserve momentum and energy too."""
    u, n = resolve(p, restitution=e)
    across = np.array([-n[1], n[0]])
    scale = scale_of(p, u)
    close(u[:2] @ across, p[2:4] @ across, 16, scale)
    close(u[2:] @ across, p[4:6] @ across, 16, scale)
    close((u[2:] - u[:2]) @ n, e * (np.subtract(p[2:4], p[4:6]) @ n), 32, scale)


@given(pair)
def test_twice_gives_the_velocities_back(p):
    u, n = resolve(p)
    back = collide.resolve_2d(*p[:2], *u, *n)
    close(back, p[2:6], 32, scale_of(p, u))


@given(pair, restitutions)
def test_swapping_the_balls_swaps_the_answer(p, e):
    u, n = resolve(p, restitution=e)
    m1, m2, v1x, v1y, v2x, v2y, _ = p
    swapped = collide.resolve_2d(m2, m1, v2x, v2y, v1x, v1y, *-n, restitution=e)
    close([*swapped[2:], *swapped[:2]], u, 8, scale_of(p, u))


@given(pair, st.sampled_from([-1.0, 1e200, -1e200, 1e-200, 3.0, -0.1]), restitutions)
def test_only_the_direction_of_the_normal_counts(p, factor, e):
    u, n = resolve(p, restitution=e)
    close(collide.resolve_2d(*p[:6], *(factor * n), restitution=e), u, 16, scale_of(p, u))


@given(pair, velocities, velocities, restitutions)
def test_galilean_shift(p, wx, wy, e):
    shift = np.array([wx, wy, wx, wy])
    u, n = resolve(p, restitution=e)
    moving = np.array(collide.resolve_2d(*p[:2], *(p[2:6] + shift), *n, restitution=e))
    close(moving - shift, u, 32, scale_of(p, u) + np.abs(shift).max())


@given(pair, angles, restitutions)
def test_rotation(p, angle, e):
    c, s = np.cos(angle), np.sin(angle)
    turn = np.kron(np.eye(2), [[c, -s], [s, c]])
    u, n = resolve(p, restitution=e)
    turned = collide.resolve_2d(*p[:2], *(turn @ p[2:6]), *(turn[:2, :2] @ n), restitution=e)
    close(turned, turn @ u, 48, scale_of(p, u))


vector = st.tuples(velocities, velocities, velocities).map(np.array)
unit = st.tuples(angles, st.floats(-1.0, 1.0)).map(
    lambda x: np.array([np.sqrt(1 - x[1] ** 2) * np.cos(x[0]), np.sqrt(1 - x[1] ** 2) * np.sin(x[0]), x[1]])
)


@given(masses, masses, vector, vector, unit, unit, restitutions)
def test_in_space(m1, m2, v1, v2, n, axis, e):
    """Momentum, energy, what is across and along, both balls exchanged, and turned with all of space."""

    def resolve(m1, m2, v1, v2, n):
        return np.array(collide.resolve_3d(m1, m2, *v1, *v2, *n, restitution=e)).reshape(2, 3)

    u1, u2 = resolve(m1, m2, v1, v2, n)
    scale = max(np.abs([v1, v2, u1, u2]).max(), 1e-300)
    close(m1 * (u1 - v1) + m2 * (u2 - v2), 0, 16, scale * (m1 + m2))
    lost = m1 * m2 / (m1 + m2) * (1 - e * e) * ((v1 - v2) @ n) ** 2
    close(m1 * (u1 @ u1 - v1 @ v1) + m2 * (u2 @ u2 - v2 @ v2), -lost, 96, (m1 + m2) * scale**2)
    close((u2 - u1) @ n, e * ((v1 - v2) @ n), 48, scale)
    for u, v in ((u1, v1), (u2, v2)):
        close(np.cross(u, n), np.cross(v, n), 24, scale)
    close(resolve(m2, m1, v2, v1, -n)[::-1], [u1, u2], 8, scale)
    mirror = np.eye(3) - 2 * np.outer(axis, axis)  # a turn by half about any axis, and a reflection
    close(resolve(m1, m2, mirror @ v1, mirror @ v2, mirror @ n), [mirror @ u1, mirror @ u2], 96, scale)


@given(masses, masses, speeds, angles, speeds, angles, angles, restitutions)
def test_polar_equals_plane(m1, m2, v1, theta1, v2, theta2, phi, e):
    u = np.array(collide.resolve_polar(m1, m2, v1, theta1, v2, theta2, phi, restitution=e))
    v = v1 * np.cos(theta1), v1 * np.sin(theta1), v2 * np.cos(theta2), v2 * np.sin(theta2)
    want = collide.resolve_2d(m1, m2, *v, np.cos(phi), np.sin(phi), restitution=e)
    close(want, u, 24, max(v1, v2, np.abs(u).max()))


@given(masses, velocities, velocities, angles)
def test_an_immovable_ball_is_a_mirror(m, vx, vy, phi):
    n = np.array([np.cos(phi), np.sin(phi)])
    v = np.array([vx, vy])
    mirrored = v - 2 * (v @ n) / (n @ n) * n
    u = np.array(collide.resolve_2d(m, np.inf, vx, vy, 0.0, 0.0, *n))
    close(u[:2], mirrored, 16, np.abs(v).max())
    assert not u[2:].any()
    u = np.array(collide.resolve_2d(np.inf, m, 0.0, 0.0, vx, vy, *n))
    close(u[2:], mirrored, 16, np.abs(v).max())
    assert not u[:2].any()


@given(masses, masses, velocities, velocities, restitutions)
def test_on_a_line(m1, m2, v1, v2, e):
    u1, u2 = collide.resolve_1d(m1, m2, v1, v2, restitution=e)
    scale = max(abs(v1), abs(v2), abs(u1), abs(u2))
    close(m1 * u1 + m2 * u2, m1 * v1 + m2 * v2, 16, (m1 + m2) * scale)
    close(u2 - u1, e * (v1 - v2), 16, scale)
    close(collide.resolve_2d(m1, m2, v1, 0.0, v2, 0.0, 1.0, 0.0, restitution=e)[::2], (u1, u2), 8, scale)


@given(pair)
def test_a_test_particle_changes_nothing(p):
    u, _ = resolve((p[0], 0.0, *p[2:]))
    assert tuple(u[:2]) == tuple(p[2:4])


@pytest.mark.parametrize(("phi", "u1", "u2"), [(0.0, (0, 1), (2, 0)), (np.pi / 2, (2, 0), (0, 1))])
def test_quarter_turns(phi, u1, u2):
    u = collide.resolve_polar(1.0, 1.0, np.hypot(2, 1), np.arctan2(1, 2), 0.0, 0.0, phi)
    close(u, [*u1, *u2], 4, 2)

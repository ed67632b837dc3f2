"""JAX: the NumPy expressions under jax.jit, inputs already on its device, which is the processor.

It allocates its results, as its users would have it do.
"""

from __future__ import annotations

import os
from typing import Any

from cases import Call, Case

from .missing import collisions_on_all_threads_only, peer
from .numpy_expression import line, plane, space


def batch(case: Case) -> Call:
    collisions_on_all_threads_only(case)
    os.environ.setdefault("JAX_PLATFORMS", "cpu")
    jax = peer("jax")
    jnp = peer("jax.numpy")
    jax.config.update("jax_enable_x64", True)

    def plane_from_polar(m1: Any, m2: Any, v1: Any, theta1: Any, v2: Any, theta2: Any, phi: Any) -> Any:
        ax, ay, bx, by = v1 * jnp.cos(theta1), v1 * jnp.sin(theta1), v2 * jnp.cos(theta2), v2 * jnp.sin(theta2)
        return plane(m1, m2, ax, ay, bx, by, jnp.cos(phi), jnp.sin(phi))

    function = jax.jit({"1d": line, "2d": plane, "3d": space, "polar": plane_from_polar}[case.form])
    inputs = [jax.device_put(c) for c in case.columns]
    return lambda: jax.block_until_ready(function(*inputs))

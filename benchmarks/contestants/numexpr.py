"""numexpr: what has no place of its own, the factor common to all results, is evaluated once."""

from __future__ import annotations

from collections.abc import Sequence

from cases import Array, Call, Case

from .missing import collisions_on_all_threads_only, peer

RESULTS = {
    "1d": ["v1 - m2 * (2 * (v1 - v2) / (m1 + m2))", "v2 + m1 * (2 * (v1 - v2) / (m1 + m2))"],
    "2d": ["v1x - m2 * q * nx", "v1y - m2 * q * ny", "v2x + m1 * q * nx", "v2y + m1 * q * ny"],
    "3d": [
        *("v1x - m2 * q * nx", "v1y - m2 * q * ny", "v1z - m2 * q * nz"),
        *("v2x + m1 * q * nx", "v2y + m1 * q * ny", "v2z + m1 * q * nz"),
    ],
    "polar": [
        "v1 * cos(theta1) - m2 * q * cos(phi)",
        "v1 * sin(theta1) - m2 * q * sin(phi)",
        "v2 * cos(theta2) + m1 * q * cos(phi)",
        "v2 * sin(theta2) + m1 * q * sin(phi)",
    ],
}
FACTOR = {
    "2d": "2 * ((v1x - v2x) * nx + (v1y - v2y) * ny) / ((m1 + m2) * (nx * nx + ny * ny))",
    "3d": "2 * ((v1x - v2x) * nx + (v1y - v2y) * ny + (v1z - v2z) * nz) / ((m1 + m2) * (nx * nx + ny * ny + nz * nz))",
    "polar": "2 * (v1 * cos(theta1 - phi) - v2 * cos(theta2 - phi)) / (m1 + m2)",
}
NAMES = {
    "1d": ["m1", "m2", "v1", "v2"],
    "2d": ["m1", "m2", "v1x", "v1y", "v2x", "v2y", "nx", "ny"],
    "3d": ["m1", "m2", "v1x", "v1y", "v1z", "v2x", "v2y", "v2z", "nx", "ny", "nz"],
    "polar": ["m1", "m2", "v1", "theta1", "v2", "theta2", "phi"],
}


def batch(case: Case) -> Call:
    collisions_on_all_threads_only(case)
    ne = peer("numexpr")
    ne.set_num_threads(case.threads)
    names = dict(zip(NAMES[case.form], case.columns, strict=True))

    def call() -> Sequence[Array]:
        if case.form != "1d":
            names["q"] = ne.evaluate(FACTOR[case.form], names)
        for expression, u in zip(RESULTS[case.form], case.out, strict=True):
            ne.evaluate(expression, names, out=u)
        return case.out

    return call

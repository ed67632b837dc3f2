"""The memory limit: the same loads and stores as collide's, by the same machinery, and next to no arithmetic.

Nothing else in this folder knows of the package's private modules, but for what the demo shares. Kernels of one's own
would differ in how they are cut into shares, and in their stores; then the difference to collide would be more than its
arithmetic.
"""

from __future__ import annotations

from cases import IMPACTS, Call, Case

from collide._cli.limit import LIMITS
from collide._pairs.execution import call


def batch(case: Case) -> Call:
    form = LIMITS[case.form]
    columns = case.columns if case.form in IMPACTS else (*case.columns, 1.0)
    return lambda: call(form, columns, False, "raise", case.out)

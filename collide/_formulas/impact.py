"""The time at which two balls that move uniformly touch: the first root of |d + w t| = R."""

from __future__ import annotations

import math
from operator import mul
from typing import Any

from .._compile.components import each
from .._compile.elementwise import as_float64, inverse_power_of_two, select, square_root
from .._compile.lanes import any_lane
from .._compile.options import formula
from .exact import dot, two_dot, two_product, two_sum


@formula
def impact(d: Any, w: Any, reach: Any) -> tuple[Any, Any]:
    """t = c / (sqrt(D) - d.w) with c = d.d - R^2 and D = R^2 w.w - (d x w)^2, in the plane; and a size.

    t is inf where they never meet, and NaN where that is later than a float64 can tell. The second number is for
    `doubt`: small unless something overflowed or is NaN. A name ending in _low is the second part of a sum of two.
    """
    d, w, reach = each(as_float64, d), each(as_float64, w), as_float64(reach)
    # Lengths and velocities near 1, by powers of two: no product overflows, and few underflow.
    length, speed = inverse_power_of_two((*d, reach)), inverse_power_of_two(w)
    d, w, reach = each(mul, length, d), each(mul, speed, w), length * reach
    dw = dot(d, w)
    ww, ww_low = two_dot(w, w)
    dd, dd_low = two_dot(d, d)
    rr, rr_low = two_product(reach, reach)
    c, c_low = two_sum(dd, -rr)
    c = c + (c_low + (dd_low - rr_low))
    cross, cross_low = two_dot((d[0], -d[1]), (w[1], w[0]))
    squared, squared_low = two_product(cross, cross)
    squared_low = squared_low + (2.0 * cross + cross_low) * cross_low
    rrww, rrww_low = two_product(rr, ww)
    rrww_low = rrww_low + (rr * ww_low + rr_low * ww)
    discriminant = (rrww - squared) + (rrww_low - squared_low)
    # Within its own error it is 0: an exact graze is a contact, and the root of an error would be some 2**-52 of R|w|.
    error = 2.0**-102 * rrww
    approaching = dw < 0.0
    t = c / select(approaching, square_root(select(discriminant > error, discriminant, 0.0)) - dw, 1.0)
    # Back to the units of the arguments: t speed / length. As length is a power of two, its inverse one is 2/length.
    speed, unit = select(approaching, speed, 1.0), inverse_power_of_two((length,))
    size, scaled = dw + c, t * (0.5 * speed * unit)
    large = scaled > 2.0**127  # what a float32 does not hold
    if any_lane(large):
        # Perhaps only the product of the factors is too large: the larger first, with room for the t of subnormal
        # velocities, up to 2**54.
        slower = speed < unit
        again = (t * (2.0**-60 * select(slower, unit, speed))) * (2.0**59 * select(slower, speed, unit))
        scaled = select(large, select(again < math.inf, again, math.nan), scaled)
        size = size + scaled
    contact = select(c <= 0.0, 0.0, select(discriminant >= -error, scaled, math.inf))
    return select(approaching, contact, math.inf), size

"""The time at which two balls that move uniformly touch: the first root of |d + w t| = R.

    t = c / (sqrt(D) - d.w),    c = d.d - R^2,    D = R^2 w.w - |d x w|^2,    where d.w < 0 and D >= 0

In the plane d x w is a number, and in space a vector: of one component and of three.

Where c and D cancel they need twice the precision. Most pairs never meet, and most of the others are not close to that:
so plain precision decides, of each pair, whether it can be sure of it, and only those in doubt have the formula in
twice the precision. Whether a pair is in doubt depends on its own numbers alone, and so do its bits: those beside a
pair in doubt keep what they had.
"""

from __future__ import annotations

import math
from operator import mul
from typing import Any

from .._compile.components import each
from .._compile.elementwise import as_float64, inverse_power_of_two, select, square_root
from .._compile.lanes import all_lanes, any_lane
from .._compile.options import formula, quiet
from .exact import dot, factors_of_cross, fused, square, two_dot, two_product, two_sum

# Plain precision keeps off what could underflow, d.w within this, and what could overflow, squares above 2**400.
_TINY = 2.0**-200


@formula
def impact(d: Any, w: Any, reach: Any) -> tuple[Any, Any]:
    """t and a size.

    t is inf where they never meet, and NaN where that is later than a float64 can tell. The size is for `doubt`: small
    unless t is large for a float32, or something overflowed or is NaN.
    """
    d, w, reach = each(as_float64, d), each(as_float64, w), as_float64(reach)
    never, usual, terms = _whether(d, w, reach)
    t, size = select(never, math.inf, math.nan), select(never, 0.0, math.nan)
    if not all_lanes(never):
        plain, sure = _plainly(d, reach, *terms)
        # At rest: seldom alone, and then quick as well. In the plane the last component is the second.
        never = never | (usual & (w[0] == 0.0) & (w[1] == 0.0) & (w[-1] == 0.0))
        told = never | (usual & sure)
        t, size = select(never, math.inf, plain), select(never, 0.0, plain)
        if not all_lanes(told):
            careful, its_size = _carefully(d, w, reach)
            t, size = select(told, t, careful), select(told, size, its_size)
    return t, size


@quiet
def _whether(d: Any, w: Any, reach: Any) -> tuple[Any, Any, Any]:
    """Whether they surely never meet; whether no product overflows or is inf or NaN; and the products.

    In the plane d.w has the right sign; in space it may not have where it is below 2**-100 of |d||w|. All components of
    d x w are off by 2**-52 of themselves at most, even where they cancel. So both sides of |d x w|^2 > R^2 w.w, a miss,
    are good to some 2**-50; 2**-40 is a wide berth.
    """
    dw, cross = dot(d, w), each(dot, *factors_of_cross(d, w))
    rr, ww, squared = reach * reach, square(w), square(cross)
    usual = squared + (rr + ww) < 2.0**400
    passing = squared > fused((1.0 + 2.0**-40) * rr, ww, _TINY * _TINY)
    return usual & ((dw > _TINY) | passing), usual, (dw, cross, rr, ww)


@quiet
def _plainly(d: Any, reach: Any, dw: Any, cross: Any, rr: Any, ww: Any) -> tuple[Any, Any]:
    """t, and whether they surely meet and its error is below 7.25 eps, in space 8 eps, if no product overflows.

    In u = eps/2 = 2**-53, and relative where nothing else is said: d.w, the components of d x w, and w.w are off by 2 u
    at most, R^2 by 1 u. c is off by 2 u, as x + x_low is exact, or by 4 u where d_x^2 > 2 R^2, if |c| > 2**-40 R^2:
    what is left are some u^2 R^2.

    (d.w)^2 + (d x w)^2 = d.d w.w, so that D = (d.w)^2 - c w.w as well. Of the two we take the one whose terms are
    smaller: with a the smaller of R^2 and c, D is off by 9 u a w.w + 6 u D, and t by that / (2 slope), where the slope
    is sqrt(D) (sqrt(D) - d.w). The first part is 7.2 u at most where the slope is over 5/8 a w.w: else we are in doubt.
    The second part, the root and d.w add 3 u, the sum 1 u, the quotient 1 u, and c its 2 u: 14.2 u. Where c is off by
    4 u, a is R^2, and D off by 8 u a w.w + 1 u D: 6.4 u + 2 u + 1 u + 1 u + 4 u = 14.4 u.

    In space w.w is off by 3 u, and D by 10 u a w.w in place of 9: two more steps, each below a w.w, take away the other
    components of d x w. With them c is off by 4 u the sum is 8 u + 1.75 u + 1 u + 1 u + 4 u = 15.75 u, as the root is
    at most half of the denominator; and where it is off by 2 u, 8 u + 3 u + 1 u + 1 u + 2 u = 15 u. d.w is off by 2 u
    there as well: within c > 2**-40 R^2 a pair that meets has |d.w| > 2**-21 |d||w|.

    All this to the first order in u: c below 2**36 R^2 keeps D, where the slope is not in doubt, above 2**-40 a w.w.
    Beside the bound on d.w it keeps all products from underflow as well.
    """
    rr_low = fused(reach, reach, -rr)
    xx, xx_low = two_product(d[0], d[0])
    x = xx - rr
    x_low = xx - (x + rr)
    low = x_low + (xx_low - rr_low)
    if len(d) == 3:
        zz, zz_low = two_product(d[2], d[2])
        x, sum_low = two_sum(x, zz)
        low = low + (sum_low + zz_low)
    c = fused(d[1], d[1], x) + low
    near = c < rr
    a, b = select(near, c, rr), select(near, dw, cross[-1])
    discriminant = fused(a, ww, -(b * b))
    if len(d) == 3:
        cross_x, cross_y = select(near, 0.0, cross[0]), select(near, 0.0, cross[1])
        discriminant = fused(-cross_y, cross_y, fused(-cross_x, cross_x, discriminant))
    discriminant = select(near, -discriminant, discriminant)
    root = square_root(select(discriminant > 0.0, discriminant, 0.0))
    t = c / (root - dw)
    slope = root * (root - dw)
    sure = (dw < -_TINY) & (abs(c) > 2.0**-40 * rr) & (c < 2.0**36 * rr) & (slope > 0.625 * a * ww)
    return select(t > 0.0, t, 0.0), sure  # c < 0 where they overlap: a time of 0


@formula
def _carefully(d: Any, w: Any, reach: Any) -> tuple[Any, Any]:
    """t and the size for any pair. A name ending in _low is the second part of a sum of two."""
    # Lengths and velocities near 1, by powers of two: no product overflows, and few underflow.
    length, speed = inverse_power_of_two((*d, reach)), inverse_power_of_two(w)
    d, w, reach = each(mul, length, d), each(mul, speed, w), length * reach
    dw = dot(d, w)
    ww, ww_low = two_dot(w, w)
    dd, dd_low = two_dot(d, d)
    rr, rr_low = two_product(reach, reach)
    c, c_low = two_sum(dd, -rr)
    c = c + (c_low + (dd_low - rr_low))
    cross = each(two_dot, *factors_of_cross(d, w))
    squared, squared_low = _two_square(cross)
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


@formula
def _two_square(x: Any) -> tuple[Any, Any]:
    """x.x of a vector whose components are sums of two, as one."""
    square, low = _squared(*x[-1])
    if len(x) == 3:
        square, low = _sum(square, low, *_squared(*x[0]))
        square, low = _sum(square, low, *_squared(*x[1]))
    return square, low


@formula
def _squared(x: Any, x_low: Any) -> tuple[Any, Any]:
    p, low = two_product(x, x)
    return p, low + (2.0 * x + x_low) * x_low


@formula
def _sum(x: Any, x_low: Any, y: Any, y_low: Any) -> tuple[Any, Any]:
    s, low = two_sum(x, y)
    return s, (low + y_low) + x_low

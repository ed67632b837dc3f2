"""The bounds under which a change may not let the throughput fall. `.ci/run` holds them.

Ratios of interleaved rounds, never times. A neighbour on a shared host spoils a spell of rounds, a slower kernel all of
them.
"""

from __future__ import annotations

import math
import statistics
import time
from collections.abc import Callable

from rounds import Rounds, Timed

PAUSE = 5  # seconds, in which a neighbour on the host may have gone


def hold(
    what: str,
    contestant: Timed,
    reference: Timed,
    calls: int,
    rounds: int,
    figure: Callable[[list[float]], float],
    least: float = 0.0,
    most: float = math.inf,
) -> None:
    """Fails unless the figure that rounds come to, from their ratios as `Rounds` gives them, lies within its bounds.

    It is looked at again before that: where it does not, as many rounds again are added after a pause, twice at most.
    """
    pair, ratios = Rounds(contestant, reference, calls), []
    for look in range(3):
        if look:
            time.sleep(PAUSE)
        ratios += [pair.ratio() for _ in range(rounds)]
        found = figure(ratios)
        if least <= found <= most:
            break
    bounds = " and ".join([f"at least {least}"] * (least > 0) + [f"at most {most}"] * (most < math.inf))
    print(f"\n{what}: {found:.2f} times, {bounds}", end=" ")
    assert least <= found <= most, f"{what}: {found:.3f} times, must be {bounds}"


def spells(ratios: list[float], rounds: int) -> list[float]:
    """The median of each third of `rounds`."""
    size = rounds // 3
    return [statistics.median(ratios[i : i + size]) for i in range(0, len(ratios) - size + 1, size)]


def best_spell(rounds: int) -> Callable[[list[float]], float]:
    """How many times as fast as the contestant the reference is, in the best of the spells."""
    return lambda ratios: max(spells([1 / ratio for ratio in ratios], rounds))

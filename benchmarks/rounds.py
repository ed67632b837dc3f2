"""Rounds of two calls in turn: what all benchmarks time, and all guards."""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Callable
from typing import Any

Timed = Callable[[], Any]


def calls_a_round(n: int, seconds: float = 2.5e-9) -> int:
    """How many calls of n elements, of so many seconds each, a round has: some 2 ms of collide's.

    Short calls are timed many at a time; a long one has left the caches before it ends. It follows from the case alone:
    if it were measured, two runs would compare rounds of different lengths.
    """
    return max(1, round(2e-3 / (5e-6 + seconds * n)))


@dataclasses.dataclass
class After:
    """The call, for rounds that put back before each what one call of it changes. That is not timed."""

    reset: Timed
    call: Timed

    def __call__(self) -> Any:
        return self.call()


def seconds(call: Timed, calls: int = 1) -> float:
    """Of one call."""
    began = time.perf_counter()
    for _ in range(calls):
        call()
    return (time.perf_counter() - began) / calls


class Rounds:
    """Rounds of a contestant, each after one of the reference, of `calls` calls of either.

    Interleaved, so that what slows the machine down slows both, and each after an untimed call of its own, so that
    neither finds the caches as the other left them. All times are of one call.
    """

    def __init__(self, contestant: Timed, reference: Timed, calls: int) -> None:
        reset = getattr(contestant, "reset", None)
        (reset or contestant)()
        self.contestant_seconds = seconds(contestant)
        self.calls = 1 if reset else calls
        self.prepare = reset or (contestant if self.contestant_seconds < 0.1 else reference)
        self._contestant, self._reference = contestant, reference
        self._prepare_reference = getattr(reference, "reset", reference)

    def time_reference(self) -> float:
        """The reference's part of a round, after which the contestant is ready for its own."""
        self._prepare_reference()
        took = seconds(self._reference, self.calls)
        self.prepare()
        return took

    def ratio(self) -> float:
        """Of one round, the reference's time to the contestant's."""
        return self.time_reference() / seconds(self._contestant, self.calls)

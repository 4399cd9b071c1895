"""What is done to every plate: a sound busy scene, sensors that come off, and single faults."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from hapticvlm_lab.bench.safety.core import Core
from hapticvlm_lab.bench.safety.rig import Outcome, Phase, Rig, Sums
from hapticvlm_lab.bench.safety.variations import Variation

# sums
OPEN = 16_300
SHORT = 100
PLATE_A = 0
PLATE_B = 1
SINK = 2
DRIFT_PER_STEP = 2.0  # sum: about 0.6 degC a second
JUMP = 1000  # sum: about 6 degC

SOUND = (  # touch and release, hot and cold, as far and as fast as setpoints may go
    Phase(2.0, 32.0, has_palm=False),
    Phase(3.5, 38.0),
    Phase(3.5, 20.0),
    Phase(1.5, 20.0, has_palm=False),
    Phase(2.5, 40.0, has_palm=False),
    Phase(2.5, 40.0),
    Phase(1.5, 30.0),
)


@dataclass(frozen=True, slots=True)
class Injection:
    """One fault, begun while the plate holds `before_c`."""

    name: str
    setpoint_c: float = 38.0
    lie: Callable[[], Callable[[Sums], Sums]] | None = None
    polarity: int = 1
    before_c: float = 36.0

    def script(self) -> tuple[Phase, Phase]:
        """Hold, then go on with the fault there."""
        lie = None if self.lie is None else self.lie()
        return Phase(3.0, self.before_c), Phase(20.0, self.setpoint_c, True, lie, self.polarity)


def frozen(*places: int) -> Callable[[], Callable[[Sums], Sums]]:
    """Thermistors that go on reading what they first read."""

    def begin() -> Callable[[Sums], Sums]:
        kept: list[Sums] = []

        def lie(sums: Sums) -> Sums:
            if not kept:
                kept.append(sums)
            return _with(sums, {place: kept[0][place] for place in places})

        return lie

    return begin


def drifting(place: int) -> Callable[[], Callable[[Sums], Sums]]:
    """Return a thermistor that reads colder and colder."""

    def begin() -> Callable[[Sums], Sums]:
        steps = itertools.count()

        def lie(sums: Sums) -> Sums:
            return _with(sums, {place: sums[place] + round(next(steps) * DRIFT_PER_STEP)})

        return lie

    return begin


def reading(place: int, value: int) -> Callable[[], Callable[[Sums], Sums]]:
    """Return a thermistor that reads one sum."""
    return lambda: lambda sums: _with(sums, {place: value})


def jumping(place: int) -> Callable[[], Callable[[Sums], Sums]]:
    """Return a thermistor that reads some degrees too cold from one step to the next."""
    return lambda: lambda sums: _with(sums, {place: sums[place] + JUMP})


STUCK = Injection("both plate thermistors frozen", setpoint_c=40.0, lie=frozen(PLATE_A, PLATE_B))
INJECTIONS = (
    Injection("plate thermistor open", lie=reading(PLATE_A, OPEN)),
    Injection("plate thermistor short", lie=reading(PLATE_B, SHORT)),
    Injection("sink thermistor open", lie=reading(SINK, OPEN)),
    Injection("sink thermistor short", lie=reading(SINK, SHORT)),
    Injection("plate reading jumps", lie=jumping(PLATE_A)),
    Injection("one plate thermistor frozen", setpoint_c=24.0, lie=frozen(PLATE_A)),
    Injection("plate thermistor drifts", lie=drifting(PLATE_B)),
    Injection("module wired backwards", setpoint_c=40.0, polarity=-1),
    STUCK,
)


def try_out(cores: Sequence[Core], variation: Variation, injection: Injection) -> list[Outcome]:
    """Inject a fault into one plate; an outcome a core."""
    return Rig(cores, variation, seed=1).run(injection.script())


def try_sound(cores: Sequence[Core], variation: Variation) -> list[Outcome]:
    """Run the busy scene on one sound plate; an outcome a core."""
    return Rig(cores, variation, seed=2).run(SOUND)


def _with(sums: Sums, changed: dict[int, int]) -> Sums:
    first, second, sink = (changed.get(place, value) for place, value in enumerate(sums))
    return first, second, sink


@dataclass(frozen=True, slots=True)
class Row:
    """One setting over all plates: thermistors that freeze, and sound plates switched off."""

    window_ms: int
    duty_cap: float
    is_default: bool
    peak_median_c: float
    peak_worst_c: float
    above_trip: float
    false_trips: float
    false_by: dict[str, int]


@dataclass(frozen=True, slots=True)
class Off:
    """How long after a fault the plate was off; None is never within the trial."""

    fault: str
    off_s: float | None
    guard: str

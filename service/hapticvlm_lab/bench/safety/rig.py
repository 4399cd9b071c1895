"""The firmware's own core, compiled for this machine, in a closed loop with a varied plate.

Three parts meet here. The core is the guards and the controller of the firmware, compiled without
change (g++ and the repository's `firmware/` folder are needed) and stepped from Python; its
settings are the core's build-time limits. The plate is the one plant model of the project, with
seeded scatter of module, sink, room, palm, supply and thermistors. Every range of that scatter is
an assumption: no series of such plates was measured. A script says what happens: setpoints, and
what a faulty sensor reports in place of the truth.

Cores that differ only in a guard do the same until one of them trips, so they share one plant: the
first core that has not tripped drives it.
"""

from __future__ import annotations

import ctypes
import itertools
import math
import shutil
import subprocess
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from hapticvlm.devices.faults import names
from hapticvlm.devices.plate import protocol as plate_protocol
from hapticvlm.devices.plate.protocol import Setpoint
from hapticvlm.devices.simulated.plant import CONDUCTANCE, RESISTANCE, SEEBECK, Module, Plant
from hapticvlm.errors import HapticVLMError

Sums = tuple[int, int, int]  # of both plate thermistors and the sink's, as the core reads them
Lie = Callable[[Sums], Sums]

FOLDER = Path(__file__).parents[4] / "firmware"
STEP_S = 0.02
# Current and counts at full scale (firmware/PROTOCOL.md).
FULL_SCALE_A = 3.0
FULL_SCALE_COUNTS = 512
_FLAGS = ("-std=gnu++14", "-O2", "-shared", "-fPIC", "-fno-gnu-unique")
_SUM_FULL_SCALE = 16384.0  # 16 conversions of 10 bits
_BETA_K = 3950.0
_R25_K = 298.15
RENEW_STEPS = 5
CLOSED_STEPS = 15  # 0.3 s: until the cut-out of firmware/hosttests/library.cpp has closed
TTL_MS = 250
NOISE = 4.0  # standard deviation of a sum: one count a conversion, an assumption
SEED = 11
# Sums of a thermistor that is open or short; places within Sums.
OPEN = 16_300
SHORT = 100
PLATE_A = 0
PLATE_B = 1
SINK = 2
DRIFT_PER_STEP = 2.0  # sum: about 0.6 degC a second
JUMP = 1000  # sum: about 6 degC


class CoreError(HapticVLMError):
    """Raised when the core cannot be compiled here; the text says what is missing."""


@dataclass(frozen=True, slots=True)
class Setting:
    """The build-time limits of the guards."""

    window_ms: int = 1000
    heat_limit_ma: int = 750


class Core:
    """One board. A library holds one board, so settings that run side by side are built apart."""

    def __init__(self, library: Path) -> None:
        self._library = ctypes.CDLL(str(library))
        self._library.core_faults.restype = ctypes.c_uint32
        self._step = self._library.core_step
        self.fault_bits: Callable[[], int] = self._library.core_faults

    def start(self) -> None:
        """Switch on and send hello."""
        self._library.core_start()
        self.send(plate_protocol.Hello(plate_protocol.MAJOR, plate_protocol.MINOR))

    def send(self, message: plate_protocol.Message) -> None:
        """Send a message, as bytes on the line."""
        sent = plate_protocol.encode(message, 1)
        self._library.core_receive(sent, len(sent))

    def step(self, sums: tuple[int, int, int]) -> float:
        """Run one control step on these readings; return the current, A."""
        counts: int = self._step(*sums)
        return counts * FULL_SCALE_A / FULL_SCALE_COUNTS


def build(setting: Setting, place: Path) -> Core:
    """Compile the core with a setting into a folder. Raises CoreError."""
    compiler = shutil.which("g++")
    if compiler is None:
        raise CoreError(
            "g++ is missing: install g++, with which this chart compiles the firmware's core"
        )
    glue = FOLDER / "hosttests" / "library.cpp"
    sources = sorted((FOLDER / "core").glob("*.cpp"))
    if not glue.is_file() or not sources:
        raise CoreError("the firmware/ folder is missing: run this in a checkout")
    library = place / f"core_{setting.window_ms}_{setting.heat_limit_ma}.so"
    limits = (
        f"-DRUNAWAY_WINDOW_MS={setting.window_ms}",
        f"-DHEAT_LIMIT_MA={setting.heat_limit_ma}",
    )
    files = [str(path) for path in (glue, *sources)]
    command = [compiler, *_FLAGS, *limits, f"-I{FOLDER / 'core'}", *files, "-o", str(library)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        raise CoreError(f"the firmware's core does not compile: {done.stderr.splitlines()[:1]}")
    return Core(library)


def sum_at(temperature_c: float) -> float:
    """Return the sum of 16 conversions of a sound thermistor, before noise and rounding."""
    # A thermistor's resistance falls with temperature by the beta formula; in a divider with an
    # equal resistor it gives this share of full scale. Colder therefore means a larger sum.
    ratio = math.exp(_BETA_K * (1.0 / (temperature_c + 273.15) - 1.0 / _R25_K))
    return _SUM_FULL_SCALE * ratio / (1.0 + ratio) - 8.0


@dataclass(frozen=True, slots=True)
class Variation:
    """One plate: module, sink, room, palm, supply and thermistors."""

    module: Module
    sink_k_per_w: float
    ambient_c: float
    palm_resistance: float  # when a palm is there
    supply: float  # of the nominal current
    offsets_c: tuple[float, float, float]  # of the thermistors on plate, plate and sink

    def plant(self) -> Plant:
        """Return the plant, without a hand, warm from use."""
        return Plant(
            self.ambient_c,
            self.sink_k_per_w,
            palm_resistance=math.inf,
            sink_c=self.ambient_c + 1.0,
            module=self.module,
        )


def draw_plates(count: int, seed: int = SEED) -> list[Variation]:
    """Draw plates; a seed gives the same ones again."""
    rng = np.random.default_rng(seed)
    return [_variation(rng) for _ in range(count)]


def _variation(rng: np.random.Generator) -> Variation:
    # Uniform where a data sheet gives a range, normal for the thermistors, whose tolerance is a
    # deviation. The logarithm of the palm's resistance is uniform: it varies by a factor of ten.
    module = Module(
        seebeck=SEEBECK * rng.uniform(0.95, 1.05),
        resistance=RESISTANCE * rng.uniform(0.9, 1.15),
        conductance=CONDUCTANCE * rng.uniform(0.9, 1.1),
        face_j_per_k=rng.uniform(0.7, 2.0),
        sink_j_per_k=rng.uniform(20.0, 150.0),
    )
    offsets = rng.normal(0.0, 0.2, 3)  # degC, of 1 % parts
    return Variation(
        module,
        sink_k_per_w=rng.uniform(1.0, 5.0),
        ambient_c=rng.uniform(15.0, 32.0),
        palm_resistance=float(10.0 ** rng.uniform(-4.0, -3.0)),
        supply=rng.uniform(0.85, 1.1),
        offsets_c=(float(offsets[0]), float(offsets[1]), float(offsets[2])),
    )


@dataclass(frozen=True, slots=True)
class Phase:
    """A setpoint for some seconds; `lie` turns true readings into those that the board gets."""

    seconds: float
    setpoint_c: float
    has_palm: bool = True
    lie: Lie | None = None
    polarity: int = 1


@dataclass(frozen=True, slots=True)
class Outcome:
    """Hottest and coldest true plate until off; faults and time since the last phase began."""

    peak_c: float
    coldest_c: float
    faults: tuple[str, ...]
    off_after_s: float | None


class Rig:
    """Some cores on one plate, for one run."""

    def __init__(self, cores: Sequence[Core], variation: Variation, seed: int) -> None:
        self._cores = list(cores)
        self._variation = variation
        self._plant = variation.plant()
        self._rng = np.random.default_rng(seed)
        self._outcomes: dict[int, Outcome] = {}
        self._hottest_c = -math.inf
        self._coldest_c = math.inf
        # A board drives only after its cut-out has been open once and then closed. The core built
        # for this chart plays that in its first 200 ms, so it must not get a setpoint earlier.
        resting = self._sums(np.zeros(3))
        for core in cores:
            core.start()
            for _ in range(CLOSED_STEPS):
                core.step(resting)

    def run(self, script: Sequence[Phase]) -> list[Outcome]:
        """Run phases in order until every core is off; one outcome a core, in order."""
        for phase in script:
            resistance = self._variation.palm_resistance if phase.has_palm else math.inf
            self._plant.touch(resistance)
            self._run(phase)
        left = Outcome(self._hottest_c, self._coldest_c, (), None)
        return [self._outcomes.get(number, left) for number in range(len(self._cores))]

    def _run(self, phase: Phase) -> None:
        steps = round(phase.seconds / STEP_S)
        noise = self._rng.normal(0.0, NOISE, (steps, 3))
        for step in range(steps):
            running = [
                (number, core)
                for number, core in enumerate(self._cores)
                if number not in self._outcomes
            ]
            if not running:
                return
            if step % RENEW_STEPS == 0:
                for _, core in running:
                    core.send(Setpoint(round(phase.setpoint_c * 1000.0), TTL_MS))
            sums = self._sums(noise[step])
            seen = sums if phase.lie is None else phase.lie(sums)
            self._step(running, seen, (step + 1) * STEP_S, phase.polarity)

    def _step(
        self, running: list[tuple[int, Core]], sums: Sums, since_s: float, polarity: int
    ) -> None:
        # All cores read the same sums. The last one asked, which is the first of the list, drives
        # the plant, unless it trips in this very step; then the next one does.
        current_a = 0.0
        for number, core in reversed(running):
            driven_a = core.step(sums)
            latched = core.fault_bits()
            if latched:
                outcome = Outcome(self._hottest_c, self._coldest_c, names(latched), since_s)
                self._outcomes[number] = outcome
            else:
                current_a = driven_a
        self._plant.step(current_a * polarity * self._variation.supply, STEP_S)
        self._hottest_c = max(self._hottest_c, self._plant.plate_c)
        self._coldest_c = min(self._coldest_c, self._plant.plate_c)

    def _sums(self, noise: np.ndarray) -> Sums:
        # Each thermistor is off by its own tolerance, and its sum of 16 conversions is noisy.
        first, second, sink = self._variation.offsets_c
        plate_c = self._plant.plate_c
        sink_c = self._plant.sink_c
        return (
            round(sum_at(plate_c + first) + noise[0]),
            round(sum_at(plate_c + second) + noise[1]),
            round(sum_at(sink_c + sink) + noise[2]),
        )


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
    """One fault, begun while the plate holds `before_c`; wires are reversed from the start."""

    name: str
    setpoint_c: float = 38.0
    lie: Callable[[], Lie] | None = None
    polarity: int = 1
    before_c: float = 36.0

    def script(self) -> tuple[Phase, ...]:
        """Hold `before_c`, then go to the setpoint with the fault. Returns the phases."""
        lie = None if self.lie is None else self.lie()
        faulty = Phase(20.0, self.setpoint_c, True, lie, self.polarity)
        # Wires are not exchanged while a plate follows; the board knows a plate that followed.
        return (faulty,) if self.polarity < 0 else (Phase(3.0, self.before_c), faulty)


def frozen(*places: int) -> Callable[[], Lie]:
    """Return thermistors that keep their first reading."""

    def begin() -> Lie:
        kept: list[Sums] = []

        def lie(sums: Sums) -> Sums:
            if not kept:
                kept.append(sums)
            return _with(sums, {place: kept[0][place] for place in places})

        return lie

    return begin


def drifting(place: int) -> Callable[[], Lie]:
    """Return a thermistor that reads colder and colder."""

    def begin() -> Lie:
        steps = itertools.count()

        def lie(sums: Sums) -> Sums:
            return _with(sums, {place: sums[place] + round(next(steps) * DRIFT_PER_STEP)})

        return lie

    return begin


def reading(place: int, value: int) -> Callable[[], Lie]:
    """Return a thermistor that reads one sum."""
    return lambda: lambda sums: _with(sums, {place: value})


def jumping(place: int) -> Callable[[], Lie]:
    """Return a thermistor whose reading jumps by some degrees from one step to the next."""
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

"""Runs the compiled firmware on a simulated chip, in lock-step with the project's plant.

Time is simulated and advances only in `Board.advance`, so a run is repeatable bit for bit
(`Board.fingerprint`) on any machine. The plant advances in steps of 10 ms with the mean
current of that step. Not simulated: electrical noise but the ADC's, the driver's ripple, the two
byte deep receive buffer (simavr's is 64 deep), the supply.
"""

from __future__ import annotations

import binascii
import ctypes
import hashlib
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

from hapticvlm.devices.simulated.plant import (
    AMBIENT_C,
    FACE_J_PER_K,
    SEEBECK,
    SINK_J_PER_K,
    Bead,
    Module,
    Plant,
)

from .hardware import (
    CUT_OUT,
    CUT_OUT_BETA_K,
    NOISE_MV,
    PLATE_A,
    PLATE_B,
    SINK,
    CutOut,
    Driver,
    Skin,
    one_resistor,
    thermistor_mv,
)

HZ = 16_000_000
STEP_S = 0.01
STEP_CYCLES = round(STEP_S * HZ)
RESET_POWER_ON, RESET_EXTERNAL, RESET_BROWN_OUT = 1, 2, 4  # as in MCUSR
PARAMETERS_AT = 4  # in the EEPROM
DDRD, PORTD, PERMIT = 0x2A, 0x2B, 1 << 6  # of the cut-out's relay
STARTED_S = 0.5  # by then the button has closed the cut-out, and its proof is over
_STOPPED = (6, 7)  # simavr's cpu_Done and cpu_Crashed

Sensor = Callable[["Board"], float]  # millivolts at its pin
Wire = Literal["whole", "broken", "grounded"]


class _Bridge(ctypes.Structure):
    _fields_ = (
        ("heat", ctypes.c_double),
        ("cool", ctypes.c_double),
        ("samples", ctypes.c_uint64),
        ("shoot_through", ctypes.c_uint64),
        ("last_driven", ctypes.c_uint64),
        ("resets", ctypes.c_uint32),
        ("is_driven", ctypes.c_int32),
    )


_FUNCTIONS = {
    "host_new": ([ctypes.c_char_p, ctypes.c_uint32, ctypes.c_double], ctypes.c_void_p),
    "host_free": ([ctypes.c_void_p], None),
    "host_run": ([ctypes.c_void_p, ctypes.c_uint64], ctypes.c_int),
    "host_bridge": ([ctypes.c_void_p, ctypes.POINTER(_Bridge), ctypes.c_int], None),
    "host_is_driven": ([ctypes.c_void_p], ctypes.c_int),
    "host_voltage": ([ctypes.c_void_p, ctypes.c_int, ctypes.c_double], None),
    "host_hum": ([ctypes.c_void_p, ctypes.c_double, ctypes.c_double], None),
    "host_cut_out": ([ctypes.c_void_p, ctypes.c_int], None),
    "host_read": ([ctypes.c_void_p, ctypes.c_char_p, ctypes.c_int], ctypes.c_int),
    "host_write": ([ctypes.c_void_p, ctypes.c_char_p, ctypes.c_int], ctypes.c_int),
    "host_cycle": ([ctypes.c_void_p], ctypes.c_uint64),
    "host_bytes_lost": ([ctypes.c_void_p], ctypes.c_uint32),
    "host_peek": ([ctypes.c_void_p, ctypes.c_int], ctypes.c_int),
    "host_poke": ([ctypes.c_void_p, ctypes.c_int, ctypes.c_int], None),
    "host_reset": ([ctypes.c_void_p, ctypes.c_int], None),
    "host_hide_reset_cause": ([ctypes.c_void_p], None),
    "host_hang": ([ctypes.c_void_p, ctypes.c_int], None),
    "host_eeprom": ([ctypes.c_void_p, ctypes.c_int, ctypes.c_char_p, ctypes.c_int], None),
    "host_memory": ([ctypes.c_void_p, ctypes.c_char_p, ctypes.c_int], ctypes.c_int),
}


def load(library: Path) -> ctypes.CDLL:
    """Load the library that tests/firmware/sim builds."""
    loaded = ctypes.CDLL(str(library))
    for name, (arguments, result) in _FUNCTIONS.items():
        function = getattr(loaded, name)
        function.argtypes, function.restype = arguments, result
    return loaded


def plate_mv(board: Board) -> float:
    """Return the voltage of a working thermistor on the plate."""
    return thermistor_mv(board.bead.c)


def sink_mv(board: Board) -> float:
    """Return the voltage of a working thermistor on the sink."""
    return thermistor_mv(board.plant.sink_c)


def cut_out_mv(board: Board) -> float:
    """Return the voltage of the cut-out's thermistor, which opens it as well."""
    return thermistor_mv(board.cut_out.bead.c, CUT_OUT_BETA_K)


@dataclass(frozen=True)
class Build:
    """What differs between builds: lag of the plate's beads in s, heat capacity of the face, J/K.

    `is_told` is whether the board's EEPROM has the lag, as after `calibrate plate`. The plate of
    one resistor has no comparator: the firmware alone lets its relay hold.
    """

    bead_lag_s: float = 0.0
    face_j_per_k: float = FACE_J_PER_K
    is_told: bool = True
    has_one_resistor: bool = False


class Board:
    """One board, its module, its sensors and a palm; `now` is in simulated seconds."""

    def __init__(
        self,
        library: ctypes.CDLL,
        elf: Path,
        ambient_c: float = AMBIENT_C,
        seed: int = 1,
        build: Build = Build(),
    ) -> None:
        self._library = library
        self._host = library.host_new(str(elf).encode(), seed, NOISE_MV)
        if not self._host:
            raise RuntimeError(f"cannot load {elf}")
        self._received = bytearray()
        self._next_step = 0
        self.ambient_c = ambient_c
        self._build = build
        if build.is_told:
            self._write_lag(round(build.bead_lag_s * 1000))
        self._module = Module(face_j_per_k=build.face_j_per_k)
        self.plant = plant = Plant(ambient_c, module=self._module)
        self.bead = Bead(plant.plate_c, build.bead_lag_s)
        self.sensors: dict[int, Sensor] = {
            PLATE_A: plate_mv,
            PLATE_B: plate_mv,
            SINK: sink_mv,
            CUT_OUT: cut_out_mv,
        }
        self.driver = one_resistor() if build.has_one_resistor else Driver()
        self.cut_out = CutOut(plant.plate_c)
        self.cut_out.is_stuck = build.has_one_resistor
        self.skin = Skin()
        self.hottest_plate_c = self.coldest_plate_c = plant.plate_c
        self.hottest_sink_c = plant.sink_c
        self.cut_out_opened_at: float | None = None
        self._pressed_until_s = STARTED_S
        self.limited_s = 0.0  # time during which the passive limit acted
        self.duty = self.current_a = 0.0
        self.shared_ground_ohm = 0.0  # of the ground that thermistors and module share
        self.cut_out_wire: Wire = "whole"  # between its break contact and the board
        self._sense()

    @property
    def now(self) -> float:
        """Simulated seconds since the board was switched on."""
        return float(self._library.host_cycle(self._host)) / HZ

    @property
    def resets(self) -> int:
        """Number of resets of the chip since it was switched on."""
        return int(self._look().resets)

    @property
    def is_driven(self) -> bool:
        """Return whether the registers drive the bridge at this moment."""
        return bool(self._library.host_is_driven(self._host))

    @property
    def last_driven_at(self) -> float:
        """Return when the registers last drove the bridge, to 0.1 ms."""
        return float(self._look().last_driven) / HZ

    @property
    def shoot_through(self) -> int:
        """Number of samples in which both halves of the bridge were driven."""
        return int(self._look().shoot_through)

    def advance(self, seconds: float) -> None:
        """Advance simulated time; raise RuntimeError when the chip has stopped."""
        end = self._library.host_cycle(self._host) + round(seconds * HZ)
        while (cycle := self._library.host_cycle(self._host)) < end:
            if cycle >= self._next_step:
                self._step()
                self._next_step = cycle - cycle % STEP_CYCLES + STEP_CYCLES
            run = min(end, self._next_step) - cycle
            if self._library.host_run(self._host, run) in _STOPPED:
                raise RuntimeError("the simulated chip has stopped")

    def write(self, data: bytes) -> int:
        """Queue bytes on the board's receive line; they arrive at the baud rate."""
        return int(self._library.host_write(self._host, data, len(data)))

    def read(self) -> bytes:
        """Return the bytes that the board has sent since the last call."""
        buffer = ctypes.create_string_buffer(4096)
        data = b""
        while count := self._library.host_read(self._host, buffer, len(buffer)):
            data += buffer.raw[:count]
        return data

    def reset(self, cause: int) -> None:
        """Reset the chip externally, for example by a brown-out."""
        self._library.host_reset(self._host, cause)

    def hide_reset_cause(self) -> None:
        """Simulate a boot loader that clears the cause of every reset, as optiboot does."""
        self._library.host_hide_reset_cause(self._host)

    def hang(self, *, interrupts: bool) -> None:
        """Make the program hang in one instruction."""
        self._library.host_hang(self._host, int(not interrupts))

    def peek(self, address: int) -> int:
        """Read one register or byte of RAM."""
        return int(self._library.host_peek(self._host, address))

    def poke(self, address: int, value: int) -> None:
        """Write one register or byte of RAM."""
        self._library.host_poke(self._host, address, value)

    def bytes_lost(self) -> int:
        """Number of sent bytes that were not read in time."""
        return int(self._library.host_bytes_lost(self._host))

    def fingerprint(self) -> str:
        """Digest of registers, I/O, RAM, cycle count and plant state."""
        memory = ctypes.create_string_buffer(4096)
        size = self._library.host_memory(self._host, memory, len(memory))
        digest = hashlib.sha256(memory.raw[:size])
        digest.update(self._library.host_cycle(self._host).to_bytes(8, "little"))
        digest.update(self.plant._state_c.tobytes())
        return digest.hexdigest()

    def hum(self, millivolts: float, hertz: float) -> None:
        """Add mains hum of this amplitude to every thermistor's pin."""
        self._library.host_hum(self._host, millivolts, hertz)

    def change_sink(self, k_per_w: float, j_per_k: float = SINK_J_PER_K) -> None:
        """Change the thermal resistance of the sink, as when its fan dies."""
        module, palm = replace(self._module, sink_j_per_k=j_per_k), self.plant.palm_resistance
        changed = Plant(self.ambient_c, k_per_w, palm, module=module)
        changed._state_c = self.plant._state_c.copy()
        self.plant = changed

    def close(self) -> None:
        """Switch the board off; it cannot be used afterwards."""
        if self._host:
            self._library.host_free(self._host)
            self._host = None

    def rest_of_heat(self, seconds: float) -> None:
        """Simulate the plant without current while the bridge stays off; the chip does not run."""
        for _ in range(round(seconds / 0.1)):
            self._live(0.0, 0.1)

    def press_start(self) -> None:
        """Hold the cut-out's start button for half a second, beginning now."""
        self._pressed_until_s = self.now + STARTED_S

    def _write_lag(self, lag_ms: int) -> None:
        """Store the lag as the firmware does: its two bytes, then their CRC."""
        record = lag_ms.to_bytes(2, "little")
        record += binascii.crc_hqx(record, 0xFFFF).to_bytes(2, "little")
        self._library.host_eeprom(self._host, PARAMETERS_AT, record, len(record))

    def _look(self, *, restart: bool = False) -> _Bridge:
        """Read counters and means; `restart` resets the means for the next step."""
        bridge = _Bridge()
        self._library.host_bridge(self._host, ctypes.byref(bridge), int(restart))
        return bridge

    def _step(self) -> None:
        bridge = self._look(restart=True)
        self.duty = bridge.heat - bridge.cool
        self.cut_out.is_pressed = self.now < self._pressed_until_s
        self.cut_out.is_permitted = bool(self.peek(DDRD) & self.peek(PORTD) & PERMIT)
        if self.now < STARTED_S:  # the plant starts when the cut-out is started
            self.cut_out.feel(self.plant.plate_c, STEP_S)
            self._sense()
            return
        conducts = not self.cut_out.is_open
        emf_v = SEEBECK * (self.plant.plate_c - self.plant.sink_c)
        self._live(self.driver.current_a(self.duty, emf_v) if conducts else 0.0, STEP_S)
        self.limited_s += STEP_S * (conducts and self.driver.is_limiting(self.duty))
        self._sense()

    def _live(self, current_a: float, dt_s: float) -> None:
        self.current_a = current_a
        self.plant.step(current_a, dt_s)
        self.bead.feel(self.plant.plate_c, dt_s)
        self.cut_out.feel(self.plant.plate_c, dt_s)
        if self.cut_out.is_open and self.cut_out_opened_at is None:
            self.cut_out_opened_at = self.now
        self.skin.feel(self.plant.skin_c, dt_s)
        self.hottest_plate_c = max(self.hottest_plate_c, self.plant.plate_c)
        self.coldest_plate_c = min(self.coldest_plate_c, self.plant.plate_c)
        self.hottest_sink_c = max(self.hottest_sink_c, self.plant.sink_c)

    def _sense(self) -> None:
        shift_mv = 1000.0 * self.shared_ground_ohm * self.current_a
        for channel, sensor in self.sensors.items():
            self._library.host_voltage(self._host, channel, sensor(self) + shift_mv)
        grounds = {"whole": self.cut_out.is_open, "broken": False, "grounded": True}
        self._library.host_cut_out(self._host, int(grounds[self.cut_out_wire]))

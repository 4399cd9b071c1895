"""The firmware's own core, compiled for this machine and stepped from Python. Copies no logic.

Needs g++ and the repository's `firmware/` folder. Settings are the core's build-time limits.
"""

from __future__ import annotations

import ctypes
import math
import shutil
import subprocess
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from hapticvlm.devices.plate import protocol as plate_protocol
from hapticvlm.errors import HapticVLMError

FOLDER = Path(__file__).parents[4] / "firmware"
STEP_S = 0.02
# firmware/PROTOCOL.md
FULL_SCALE_A = 3.0
FULL_SCALE_COUNTS = 512
_FLAGS = ("-std=gnu++14", "-O2", "-shared", "-fPIC", "-fno-gnu-unique")
_SUM_FULL_SCALE = 16384.0  # 16 conversions of 10 bits
_BETA_K = 3950.0
_R25_K = 298.15


class CoreError(HapticVLMError):
    """The core can't be compiled here."""


@dataclass(frozen=True, slots=True)
class Setting:
    """What the guards are built with."""

    window_ms: int = 1000
    heat_limit_ma: int = 750


class Core:
    """One board; one library holds one, so settings that run side by side are built apart."""

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
        """Make one control step on what the thermistors read; return the current, A."""
        counts: int = self._step(*sums)
        return counts * FULL_SCALE_A / FULL_SCALE_COUNTS


def build(setting: Setting, place: Path) -> Core:
    """Compile the core with a setting into a folder. Raises CoreError, naming what is missing."""
    compiler = shutil.which("g++")
    if compiler is None:
        raise CoreError("the firmware's core is compiled for this chart: install g++")
    glue = FOLDER / "hosttests" / "library.cpp"
    sources = sorted((FOLDER / "core").glob("*.cpp"))
    if not glue.is_file() or not sources:
        raise CoreError("needs the repository's firmware/ folder: run it from a checkout")
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
    """Sum of 16 conversions that a sound thermistor gives, before noise and rounding."""
    ratio = math.exp(_BETA_K * (1.0 / (temperature_c + 273.15) - 1.0 / _R25_K))
    return _SUM_FULL_SCALE * ratio / (1.0 + ratio) - 8.0

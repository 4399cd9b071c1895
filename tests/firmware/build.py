"""Builds the firmware and the chip's host with the machine's compilers, outside the sources.

HAPTICVLM_FIRMWARE selects another firmware folder, for planted defects.
"""

from __future__ import annotations

import ctypes
import os
import re
import subprocess
from dataclasses import dataclass
from pathlib import Path

from shared_build import built_once

from hapticvlm.devices.simulated.plant import AMBIENT_C

from .board import Board, Build, load

USUAL = Build()
HERE = Path(__file__).parent
FIRMWARE = Path(os.environ.get("HAPTICVLM_FIRMWARE", HERE.parents[1] / "firmware"))


@dataclass(frozen=True)
class Chip:
    """The built parts; makes boards."""

    library: ctypes.CDLL
    elf: Path
    one_resistor_elf: Path

    def board(self, ambient_c: float = AMBIENT_C, seed: int = 1, build: Build = USUAL) -> Board:
        """Return a new board, switched on."""
        elf = self.one_resistor_elf if build.has_one_resistor else self.elf
        return Board(self.library, elf, ambient_c, seed, build)


def constant(name: str, file: str = "limits.h") -> float:
    """Return a number that stands in a file of the core."""
    text = (FIRMWARE / "core" / file).read_text()
    return float(re.findall(rf"\b{name} = ([0-9.]+)f?[,;]", text)[0])


def build(folder: Path) -> Chip:
    """Compile both into `folder`."""
    build_host(folder / "host")
    build_firmware(folder / "firmware")
    build_firmware(folder / "one_resistor", "DEFINES=-DONE_RESISTOR")
    return opened(folder)


def shared() -> Chip:
    """Return the result of `build` that all tests share."""
    return opened(built_once("firmware", build, FIRMWARE / "core", FIRMWARE / "avr", HERE / "sim"))


def opened(folder: Path) -> Chip:
    """Return the result of `build` in `folder`."""
    elf, one_resistor_elf = (
        next((folder / plate).glob("*.elf")) for plate in ("firmware", "one_resistor")
    )
    return Chip(load(folder / "host" / "libavrhost.so"), elf, one_resistor_elf)


def build_host(folder: Path) -> None:
    """Compile the host of the simulated chip into `folder`."""
    _make(HERE / "sim", f"BUILD={folder}")


def build_firmware(folder: Path, *settings: str) -> None:
    """Compile the firmware into `folder`."""
    _make(FIRMWARE / "avr", f"BUILD={folder}", *settings)


def _make(folder: Path, *settings: str) -> None:
    command = ["make", "--no-print-directory", "-C", str(folder), *settings]
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode:
        raise RuntimeError(f"{' '.join(command)}\n{done.stdout}{done.stderr}")

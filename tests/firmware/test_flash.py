"""The shipped program: built from these sources, and written by `hapticvlm plate flash`.

avrdude is replaced by a stand-in that passes the file to simavr, like a boot loader.
"""

from __future__ import annotations

import importlib.util
import os
import shutil
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

import pytest

from hapticvlm.commands import flash
from hapticvlm.commands.main import main

from .board import Board
from .build import FIRMWARE, Chip
from .rawhost import RawHost

pytest.importorskip("pty", reason="Windows has none")
from firmware_port import FirmwarePort, firmware_on_a_terminal


@pytest.fixture(scope="module")
def prebuilt() -> ModuleType:
    found = importlib.util.spec_from_file_location("prebuilt", FIRMWARE / "prebuilt.py")
    assert found is not None
    assert found.loader is not None
    module = importlib.util.module_from_spec(found)
    found.loader.exec_module(module)
    return module


def test_the_shipped_program_is_made_of_these_sources(prebuilt: ModuleType) -> None:
    print(prebuilt.compared())  # states whether bytes were compared

    assert flash.SHIPPED.parent == prebuilt.SHIPPED
    assert prebuilt.differences() == []


def test_other_sources_another_version_and_other_bytes_are_told(
    prebuilt: ModuleType, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    shutil.copytree(FIRMWARE, tmp_path / "firmware")
    monkeypatch.setattr(prebuilt, "HERE", tmp_path / "firmware")
    assert prebuilt.differences() == []
    with (tmp_path / "firmware" / "core" / "limits.h").open("a") as header:
        header.write("// changed\n")
    assert "sources have changed" in prebuilt.differences()[0]
    for name in prebuilt.DEFINES:
        (tmp_path / name).write_bytes(b":00000001FF\n")
    monkeypatch.setattr(prebuilt, "SHIPPED", tmp_path)
    assert "does not have the SHA-256" in prebuilt.differences()[0]


def as_elf(path: Path, folder: Path) -> Path:
    """Convert a .hex to an ELF file for simavr."""
    elf = folder / "written.elf"
    command = ["avr-objcopy", "-I", "ihex", "-O", "elf32-avr", "--rename-section", ".sec1=.text"]
    subprocess.run([*command, str(path), str(elf)], check=True)
    return elf


@pytest.mark.parametrize("one_resistor", [False, True])
def test_the_shipped_program_runs_and_tells_its_version(
    chip: Chip, tmp_path: Path, *, one_resistor: bool
) -> None:
    image = flash.shipped(one_resistor=one_resistor)
    board = Board(chip.library, as_elf(image.path, tmp_path))
    host = RawHost(board)
    host.greet()

    assert ".".join(map(str, host.greetings[0][2:5])) == str(image.version).split()[0]
    host.hold(34.0, 1.0)
    assert board.is_driven
    board.close()


@pytest.fixture
def cable(chip: Chip, tmp_path: Path) -> Iterator[FirmwarePort]:
    """A board built with its own board number."""
    command = ["make", "-C", str(FIRMWARE / "avr"), f"BUILD={tmp_path}/own", "BOARD_ID=7"]
    subprocess.run(command, check=True, capture_output=True)
    board = Board(chip.library, tmp_path / "own" / "plate.elf")
    with firmware_on_a_terminal(board) as cable:
        yield cable
    cable.board.close()


def test_flash_says_what_is_there_writes_and_asks_the_board_again(
    chip: Chip,
    cable: FirmwarePort,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    asked, written = tmp_path / "asked", tmp_path / "written"
    program = tmp_path / "avrdude"
    program.write_text(
        f"#!{sys.executable}\nimport sys, time, pathlib\n"
        f"pathlib.Path({str(asked)!r}).write_text(sys.argv[-1])\n"
        f"while not pathlib.Path({str(written)!r}).exists(): time.sleep(0.01)\n"
    )
    program.chmod(0o755)
    monkeypatch.setenv("PATH", f"{tmp_path}{os.pathsep}{os.environ['PATH']}")

    def boot_loader() -> None:
        while not asked.exists() or not asked.read_text():
            time.sleep(0.01)
        path = Path(asked.read_text().removeprefix("flash:w:").removesuffix(":i"))
        elf = as_elf(path, tmp_path)
        with cable.lock:
            cable.board.close()
            cable.board = Board(chip.library, elf)
        written.touch()

    loader = threading.Thread(target=boot_loader)
    loader.start()
    code = main(["plate", "flash", "--port", cable.path, "--one-resistor"])
    loader.join()
    printed = capsys.readouterr()

    version, image = flash.shipped().version, flash.shipped(one_resistor=True)
    assert code == 0, printed.err
    assert f"{cable.path}: firmware {version} (board 7) now" in printed.out
    assert f"writing firmware {version} for one resistor ({image.size} bytes" in printed.out
    assert f"answers with firmware {version} for one resistor (board 0)" in printed.out
    assert main(["plate", "flash", "--port", cable.path, "--dry-run"]) == 0
    assert f"would write {image.text}" in capsys.readouterr().out, "an update keeps it"

"""Tests that every failure of `hapticvlm plate flash` is one line; avrdude is a stand-in.

tests/firmware/test_flash.py flashes a simulated board.
"""

from __future__ import annotations

import os
import tomllib
from collections.abc import Iterator
from pathlib import Path

import pytest
from word_tables import words

from hapticvlm.commands import flash
from hapticvlm.commands.main import main
from hapticvlm.devices.plate import peltier
from hapticvlm.devices.plate.ports import PortInfo

pty = pytest.importorskip("pty", reason="Windows has none, and runs no shell scripts")

ROOT = Path(__file__).parents[2]


@pytest.fixture
def silent_port(monkeypatch: pytest.MonkeyPatch) -> Iterator[str]:
    """A port that opens and never answers, like an Uno with another program."""
    monkeypatch.setattr(peltier, "HANDSHAKE_S", 0.1)
    ours, theirs = pty.openpty()
    yield os.ttyname(theirs)
    os.close(theirs)
    os.close(ours)


def stand_in(folder: Path, monkeypatch: pytest.MonkeyPatch, script: str) -> None:
    """Put a program named avrdude, and nothing else, on PATH."""
    program = folder / "avrdude"
    program.write_text(f"#!/bin/sh\n{script}\n")
    program.chmod(0o755)
    monkeypatch.setenv("PATH", str(folder))


def error_line(capsys: pytest.CaptureFixture[str], *arguments: str) -> str:
    """Run the command, which must fail, and return its one line."""
    assert main(["plate", "flash", *arguments]) == 2
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 1
    return lines[0]


def test_without_avrdude_it_says_where_to_get_it_on_three_systems(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    line = error_line(capsys, "--port", "/dev/nowhere")

    for system in ("Windows: winget", "macOS: brew", "Debian, Ubuntu: sudo apt"):
        assert system in line


def test_no_board_and_a_wrong_port_are_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    stand_in(tmp_path, monkeypatch, "exit 1")

    assert "/dev/nowhere can't be opened" in error_line(capsys, "--port", "/dev/nowhere")
    monkeypatch.setattr("hapticvlm.devices.plate.ports._present", list)
    assert "seen: none; plug the plate in, or name its port, such as --peltier " in error_line(
        capsys
    )


def test_a_board_that_does_not_answer_is_written_only_when_its_port_is_named(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    silent_port: str,
) -> None:
    called = tmp_path / "called"
    stand_in(tmp_path, monkeypatch, f'echo "$@" > {called}')
    place = PortInfo(silent_port, "Arduino Uno")
    monkeypatch.setattr("hapticvlm.devices.plate.ports._present", lambda: [(place, True)])

    assert f"--port {silent_port}" in error_line(capsys)
    assert not called.exists()
    assert "does not answer as a plate" in error_line(capsys, "--port", silent_port)
    assert called.read_text().split() == [
        *flash.AVRDUDE,
        "-P",
        silent_port,
        "-U",
        f"flash:w:{flash.SHIPPED}:i",
    ]


# As avrdude 6 and 7.1 say it; the third says nothing, the last has words that nobody foresaw.
@pytest.mark.parametrize(
    ("said", "reason", "advice"), words(Path(__file__).with_name("avrdude.csv"), "said")
)
def test_what_avrdude_says_when_it_fails_is_passed_on_in_a_line(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    silent_port: str,
    said: str,
    reason: str,
    advice: str,
) -> None:
    script = f'echo "{said}" >&2; echo "avrdude done.  Thank you." >&2; exit 1'
    stand_in(tmp_path, monkeypatch, script)
    line = error_line(capsys, "--port", silent_port)

    assert reason in line
    assert advice in line


def test_a_file_that_is_no_program_of_this_chip_is_refused_before_anything_is_opened(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    whole = flash.SHIPPED.read_text().split()
    spoilt = {
        "a picture.hex": "PNG",
        "one digit.hex": "\n".join([whole[0][:-1] + "0", *whole[1:]]),
        "cut.hex": "\n".join(whole[:-1]),
        "too high.hex": ":017E0000FF82\n:00000001FF",
    }
    for name, content in spoilt.items():
        (tmp_path / name).write_text(content)
        assert "is not an Intel HEX file" in error_line(capsys, "--hex", str(tmp_path / name)), name
    assert "No such file" in error_line(capsys, "--hex", str(tmp_path / "none"))


def test_the_wheel_holds_the_program_and_its_facts() -> None:
    package = (
        ROOT
        / tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["hatch"]["build"]["targets"][
            "wheel"
        ]["packages"][0]
    )

    assert flash.SHIPPED.is_relative_to(package)
    assert flash.SHIPPED.stat().st_size < 70_000
    assert flash.shipped().size < flash.FLASH_BYTES

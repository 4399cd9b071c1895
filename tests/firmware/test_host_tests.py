"""The firmware's core on this machine: tests with sanitizers, two fuzzers, and its size."""

from __future__ import annotations

import re
import subprocess
from pathlib import Path

import pytest
from toolchains import require

from .build import FIRMWARE

FUZZ_S = 2
SLOWEST_S = 600  # for a build on a loaded machine


def make(folder: str, *arguments: str) -> str:
    """Run make in a folder of the firmware and return its output; a failure fails the test."""
    command = ["make", "--no-print-directory", "-C", str(FIRMWARE / folder), *arguments]
    done = subprocess.run(
        command, capture_output=True, text=True, errors="replace", timeout=SLOWEST_S
    )
    assert done.returncode == 0, (done.stdout + done.stderr)[-6000:]
    return done.stdout + done.stderr


@pytest.fixture(scope="session")
def build(tmp_path_factory: pytest.TempPathFactory) -> str:
    return f"BUILD={tmp_path_factory.mktemp('hosttests')}"


@pytest.mark.nightly
def test_the_core_passes_its_own_tests_under_the_sanitizers(build: str) -> None:
    require("g++", "make", "doctest")
    printed = make("hosttests", build, "test")

    assert "Status: SUCCESS!" in printed
    assert " 0 skipped" in printed


@pytest.mark.nightly
def test_neither_bytes_nor_payloads_break_the_core(build: str) -> None:
    require("g++", "make", "doctest", "clang++-14")
    printed = make("hosttests", build, f"SECONDS={FUZZ_S}", "fuzz")

    runs = [int(n) for n in re.findall(r"number_of_executed_units: (\d+)", printed)]
    assert len(runs) == 2
    assert min(runs) > 100, "the fuzzers ran, and on more than their seeds"


def test_the_binary_builds_without_a_warning_and_within_its_budget(tmp_path: Path) -> None:
    require("make", "avr-g++")
    printed = make("avr", f"BUILD={tmp_path}")

    assert "warning" not in printed
    assert re.search(r"flash \d+ of \d+ bytes, RAM \d+ of \d+ bytes", printed)
    assert (tmp_path / "plate.hex").read_text().startswith(":")

"""The firmware's core on this machine: tests with sanitizers, two fuzzers, and its size."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
from pathlib import Path

import pytest

from .build import FIRMWARE

FUZZ_S = 2
SLOWEST_S = 600  # for a build on a loaded machine
NEEDED = {
    "g++": "g++",
    "make": "make",
    "clang++-14": "clang-14 libclang-rt-14-dev",
    "avr-g++": "gcc-avr avr-libc",
}


def need(*tools: str) -> None:
    """Skip, or fail in CI, when a tool is missing."""
    absent = [tool for tool in tools if shutil.which(tool) is None]
    if "g++" in tools and not Path("/usr/include/doctest/doctest.h").exists():
        absent.append("doctest-dev")
    if not absent:
        return
    packages = " ".join(NEEDED.get(tool, tool) for tool in absent)
    reason = f"no {', '.join(absent)}: apt-get install {packages}"
    if os.environ.get("CI"):
        pytest.fail(reason)
    pytest.skip(reason)


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


def test_the_core_passes_its_own_tests_under_the_sanitizers(build: str) -> None:
    need("g++", "make")
    printed = make("hosttests", build, "test")

    assert "Status: SUCCESS!" in printed
    assert " 0 skipped" in printed


def test_neither_bytes_nor_payloads_break_the_core(build: str) -> None:
    need("g++", "make", "clang++-14")
    printed = make("hosttests", build, f"SECONDS={FUZZ_S}", "fuzz")

    runs = [int(n) for n in re.findall(r"number_of_executed_units: (\d+)", printed)]
    assert len(runs) == 2
    assert min(runs) > 100, "the fuzzers ran, and on more than their seeds"


def test_the_binary_builds_without_a_warning_and_within_its_budget(tmp_path: Path) -> None:
    need("make", "avr-g++")
    printed = make("avr", f"BUILD={tmp_path}")

    assert "warning" not in printed
    assert re.search(r"flash \d+ of \d+ bytes, RAM \d+ of \d+ bytes", printed)
    assert (tmp_path / "plate.hex").read_text().startswith(":")

"""Plant each defect of mutations.py in a copy of the firmware and run the test that must catch it.

    python tests/firmware/mutate.py [PART OF A NAME] [--markdown FILE]

Prints a line per defect and, last, one of JSON. Exit code 1 when a defect survives, when its text
is not found exactly once, or when a test named for it also fails on the unchanged firmware.
Host tests are built without sanitizers and optimisation, because the asserts must catch it.
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterable
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from firmware.mutations import MUTATIONS, Mutation

ROOT = Path(__file__).parents[2]
FIRMWARE = ROOT / "firmware"
HOST_FLAGS = ("SANITIZE=", "FLAGS=-std=gnu++14 -O0 -I../core -I.")
SLOWEST_S = 900


def main() -> int:
    """Run the selected defects; return 0 when all were caught."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("name", nargs="?", default="", help="only defects with this in their name")
    parser.add_argument("--markdown", type=Path, help="write the table there too")
    arguments = parser.parse_args()
    chosen = [mutation for mutation in MUTATIONS if arguments.name in mutation.name]
    began = time.monotonic()
    with tempfile.TemporaryDirectory() as folder:
        sound = Path(folder) / "sound"
        shutil.copytree(FIRMWARE, sound, ignore=shutil.ignore_patterns("build"))
        broken = sound_failures(sound, chosen)
        rows = [(mutation, verdict(mutation, sound, broken)) for mutation in report(chosen)]
    if arguments.markdown:
        arguments.markdown.write_text(as_markdown(rows))
    caught = sum(found == "caught" for _, found in rows)
    result = {
        "planted": len(rows),
        "caught": caught,
        "survived": [mutation.name for mutation, found in rows if found != "caught"],
        "seconds": round(time.monotonic() - began),
    }
    print(json.dumps(result))
    return int(caught < len(rows))


def report(chosen: list[Mutation]) -> Iterable[Mutation]:
    """Print each defect before it is tried."""
    for number, mutation in enumerate(chosen, 1):
        print(f"{number:3} of {len(chosen)}  {mutation.name}", flush=True)
        yield mutation


def sound_failures(sound: Path, chosen: list[Mutation]) -> set[str]:
    """Return the named tests that fail without any defect."""
    hosts = {mutation.host for mutation in chosen if mutation.host}
    chips = {mutation.chip for mutation in chosen if mutation.chip}
    build(sound)
    broken = {test for test in hosts if not host_passes(sound, test)}
    return broken | {test for test in chips if not chip_passes(sound, test)}


def verdict(mutation: Mutation, sound: Path, broken: set[str]) -> str:
    """Plant one defect in a copy of the unchanged firmware: return "caught" or the reason."""
    if {mutation.host, mutation.chip} & broken:
        return say("its test fails without the defect")
    planted = sound.with_name("planted")
    shutil.rmtree(planted, ignore_errors=True)
    shutil.copytree(sound, planted)
    source = planted / mutation.file
    text = source.read_text()
    if text.count(mutation.find) != 1:
        return say(f"its text occurs {text.count(mutation.find)} times")
    source.write_text(text.replace(mutation.find, mutation.replace))
    survived = [
        test for test in (mutation.host, mutation.chip) if test and passes(planted, mutation, test)
    ]
    return say(f"survived {', '.join(survived)}" if survived else "caught")


def passes(planted: Path, mutation: Mutation, test: str) -> bool:
    if test == mutation.chip:
        return chip_passes(planted, test)
    build(planted)
    return host_passes(planted, test)


def say(found: str) -> str:
    print(f"            {found}", flush=True)
    return found


def build(firmware: Path) -> None:
    """Build the host tests, reusing unchanged objects of the copy."""
    command = ["make", "-C", str(firmware / "hosttests"), "BUILD=build", *HOST_FLAGS, "build/tests"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=SLOWEST_S)
    if done.returncode:
        raise RuntimeError(done.stdout + done.stderr)


def host_passes(firmware: Path, case: str) -> bool:
    """Run one test case; it must exist."""
    command = [str(firmware / "hosttests" / "build" / "tests"), f"-tc={case}"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=SLOWEST_S)
    if "test cases: 0 " in " ".join(done.stdout.split()):
        raise RuntimeError(f"no test case {case!r}")
    return done.returncode == 0


def chip_passes(firmware: Path, test: str) -> bool:
    """Run one test on the simulated chip; it must be found and not skipped."""
    environment = os.environ | {"HAPTICVLM_FIRMWARE": str(firmware), "CI": "1"}
    path = ROOT / "tests" / "firmware" / test
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", str(path)]
    done = subprocess.run(
        command, capture_output=True, text=True, cwd=ROOT, env=environment, timeout=SLOWEST_S
    )
    if done.returncode not in (0, 1) or "RuntimeError: make" in done.stdout:
        raise RuntimeError(done.stdout + done.stderr)
    return done.returncode == 0


def as_markdown(rows: list[tuple[Mutation, str]]) -> str:
    """Return the results as a page for the firmware's folder."""
    lines = [
        "# Defects planted in the safety code",
        "",
        "`python tests/firmware/mutate.py --markdown firmware/MUTATIONS.md` plants each of",
        "these in a copy of the firmware and runs the test beside it: of `hosttests/`, or of",
        "`tests/firmware/` on the compiled binary in simavr. A defect is caught when every test",
        "named for it fails with it and passes without.",
        "",
        f"{sum(found == 'caught' for _, found in rows)} of {len(rows)} caught.",
        "",
        "| defect | in | test | result |",
        "|---|---|---|---|",
    ]
    for mutation, found in rows:
        tests = ", ".join(test.rstrip("*") for test in (mutation.host, mutation.chip) if test)
        lines.append(f"| {mutation.name} | {mutation.file} | {tests} | {found} |")
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    sys.exit(main())

"""Plant each defect of mutations.py in a copy of the firmware and run the test that must catch it.

    python tests/firmware/mutate.py [PART OF A NAME] [--markdown FILE]

Prints a line per defect and, last, one of JSON. Exit code 1 when a defect survives, when its text
is not found exactly once, or when a test named for it also fails on the unchanged firmware.
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
    return {chip for chip in {each.chip for each in chosen} if not chip_passes(sound, chip)}


def verdict(mutation: Mutation, sound: Path, broken: set[str]) -> str:
    """Plant one defect in a copy of the unchanged firmware: return "caught" or the reason."""
    if mutation.chip in broken:
        return say("its test fails without the defect")
    planted = sound.with_name("planted")
    shutil.rmtree(planted, ignore_errors=True)
    shutil.copytree(sound, planted)
    source = planted / "avr" / "main.cpp"
    text = source.read_text()
    if text.count(mutation.find) != 1:
        return say(f"its text occurs {text.count(mutation.find)} times")
    source.write_text(text.replace(mutation.find, mutation.replace))
    return say(f"survived {mutation.chip}" if chip_passes(planted, mutation.chip) else "caught")


def say(found: str) -> str:
    print(f"            {found}", flush=True)
    return found


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
        "# Defects planted in the port",
        "",
        "`python tests/firmware/mutate.py --markdown firmware/MUTATIONS.md` plants each of",
        "these in a copy of `avr/main.cpp` and runs the test beside it, of `tests/firmware/`, on",
        "the compiled binary in simavr. A defect is caught when that test fails with it and passes",
        "without. `make defects` plants those of the core by rule.",
        "",
        f"{sum(found == 'caught' for _, found in rows)} of {len(rows)} caught.",
        "",
        "| defect | test | result |",
        "|---|---|---|",
    ]
    for mutation, found in rows:
        lines.append(f"| {mutation.name} | {mutation.chip} | {found} |")
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    sys.exit(main())

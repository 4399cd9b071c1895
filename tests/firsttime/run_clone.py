"""Times the first minutes of a newcomer: `git clone`, then `make demo` at a terminal.

    python tests/firsttime/run_clone.py [--json]

Clones this checkout into a scratch folder and runs `make demo` there in a pseudo-terminal. There
is no environment yet; pip keeps what it has downloaded before. Prints when the first output came,
how long the longest silence was and after which line, and when all was done; 1 beyond a mark.
"""

from __future__ import annotations

import argparse
import json
import os
import pty
import re
import resource
import select
import subprocess
import sys
import tempfile
import time
from dataclasses import asdict, dataclass
from pathlib import Path

ROOT = Path(__file__).parents[2]
STEPS = (("git", "clone", "--no-local", str(ROOT), "clone"), ("make", "-C", "clone", "demo"))
FIRST_S, SILENCE_S, ALL_S = 1.0, 3.0, 60.0  # the marks
PATIENCE_S = 1800.0


@dataclass(frozen=True, slots=True)
class Step:
    """One command at a terminal: seconds of the wall's clock, and of all processors together.

    `before_it` was printed before the longest silence; `silences` counts those beyond the mark.
    """

    command: str
    status: int
    first_output_s: float
    longest_silence_s: float
    before_it: str
    silences: int
    seconds: float
    processor_s: float

    @property
    def holds(self) -> bool:
        """Whether it worked, and was never silent for too long."""
        is_alive = self.first_output_s <= FIRST_S and self.longest_silence_s <= SILENCE_S
        return self.status == 0 and is_alive


def at_a_terminal(command: tuple[str, ...], folder: Path) -> tuple[Step, str]:
    """Run a command in a pseudo-terminal; return its times, and all that it printed."""
    spent = _processor_s()
    terminal, end = pty.openpty()
    started = spoke = time.monotonic()
    process = subprocess.Popen(
        command, cwd=folder, env=_clean(), stdin=end, stdout=end, stderr=end, start_new_session=True
    )
    os.close(end)
    printed, first = b"", None
    silences: list[tuple[float, str]] = [(0.0, "")]
    while data := _read(terminal, started + PATIENCE_S):
        now = time.monotonic()
        first = now - started if first is None else first
        silences.append((now - spoke, _last(printed)))
        printed, spoke = printed + data, now
    os.close(terminal)
    status = process.wait(PATIENCE_S)
    ended = time.monotonic()
    silences.append((ended - spoke, _last(printed)))
    silence, before = max(silences)
    step = Step(
        " ".join(command[:2] if command[0] == "git" else command),
        status,
        round(ended - started if first is None else first, 2),
        round(silence, 2),
        before,
        sum(each > SILENCE_S for each, _ in silences),
        round(ended - started, 1),
        round(_processor_s() - spent, 1),
    )
    return step, printed.decode(errors="replace")


def _read(terminal: int, until: float) -> bytes:
    """Wait for output; nothing at the end."""
    ready, _, _ = select.select([terminal], [], [], max(0.0, until - time.monotonic()))
    try:
        return os.read(terminal, 4096) if ready else b""
    except OSError:  # Linux says so when the last program has closed it
        return b""


def _last(printed: bytes) -> str:
    rows = [row.strip() for row in re.split(rb"[\r\n]+", printed[-4000:]) if row.strip()]
    return re.sub(r"\x1b\[[0-9;?]*[a-zA-Z]", "", rows[-1].decode(errors="replace")) if rows else ""


def _clean() -> dict[str, str]:
    unwanted = ("PYTHON", "VIRTUAL_ENV", "MAKE")
    return {name: value for name, value in os.environ.items() if not name.startswith(unwanted)}


def _processor_s() -> float:
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def main() -> int:
    """Run the steps; 1 if one failed or a mark is missed."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--json", action="store_true", help="print JSON instead of a table")
    parser.add_argument("--show", action="store_true", help="print also what the steps printed")
    options = parser.parse_args()
    steps = []
    with tempfile.TemporaryDirectory() as name:
        for command in STEPS:
            step, printed = at_a_terminal(command, Path(name))
            steps.append(step)
            if options.show or step.status:
                print(printed, file=sys.stderr)
    total, load = round(sum(step.seconds for step in steps), 1), round(os.getloadavg()[0], 1)
    if options.json:
        result = {"steps": [asdict(step) for step in steps], "total_s": total, "load": load}
        print(json.dumps(result))
    else:
        columns = "{:<24}{:>13}{:>10}{:>6}{:>8}{:>11}   {}"
        heads = ("s", "first output", "silence", "over", "all", "processor", "silent after")
        print(columns.format(*heads))
        for step in steps:
            times = (step.first_output_s, step.longest_silence_s, step.silences, step.seconds)
            print(columns.format(step.command, *times, step.processor_s, step.before_it[:60]))
        print(f"{total} s in all (mark {ALL_S:.0f}); load {load}, {os.cpu_count()} cores")
    return int(total > ALL_S or not all(step.holds for step in steps))


if __name__ == "__main__":
    sys.exit(main())

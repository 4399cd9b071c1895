"""`hapticvlm doctor` checks this machine for common problems and says how to fix them.

It plays nothing and heats nothing.
"""

from __future__ import annotations

import argparse
import dataclasses
import json
import time
from pathlib import Path
from typing import TYPE_CHECKING

from hapticvlm.commands.parsing import add_json

if TYPE_CHECKING:
    from hapticvlm.commands.parsing import Commands
    from hapticvlm.doctor.findings import Finding

PATIENCE_S = 4.0
_MARKS = {"ok": "ok   ", "note": "note ", "wrong": "WRONG"}


def add(commands: Commands) -> None:
    """Declare the command and its options."""
    doctor = commands.add_parser(
        "doctor",
        help="check this machine for missing or wrong parts",
        description="Check Python, packages, port, audio outputs, plate and certificate, and say "
        "how to fix each problem. Nothing is played or heated. Exit code 1: something is wrong.",
        examples=("hapticvlm doctor", "hapticvlm doctor --config hapticvlm.toml"),
    )
    doctor.set_defaults(run=_doctor)
    doctor.add_argument(
        "--config",
        type=Path,
        metavar="FILE",
        help="check for a service that runs with this config file",
    )
    add_json(doctor)


def _doctor(options: argparse.Namespace) -> int:
    from hapticvlm.commands.progress import working

    started = time.monotonic()
    with working("checking this machine"):
        findings = _examine(options, started + PATIENCE_S)
    is_well = all(finding.verdict != "wrong" for finding in findings)
    if options.json:
        rows = [dataclasses.asdict(finding) for finding in findings]
        seconds = round(time.monotonic() - started, 2)
        verdict = "ok" if is_well else "wrong"
        print(json.dumps({"doctor": verdict, "seconds": seconds, "findings": rows}))
    else:
        _print(findings)
    return 0 if is_well else 1


def _examine(options: argparse.Namespace, deadline: float) -> list[Finding]:
    """Run every check; those that may hang run in threads beside the others."""
    from hapticvlm.commands import serve
    from hapticvlm.doctor import machine
    from hapticvlm.doctor.findings import BackgroundCheck, Finding
    from hapticvlm.server.settings import ServeOptions

    first = [machine.python(), *machine.packages()]
    if any(finding.verdict == "wrong" for finding in first):
        return first
    from hapticvlm.doctor import devices, network

    try:
        serve_options = serve.resolve_options(options)
    except ValueError as error:
        first.append(Finding("config", "wrong", str(error)))
        serve_options = ServeOptions()
    audio = BackgroundCheck("audio", lambda: devices.audio(serve_options))
    plates = BackgroundCheck("plate", lambda: devices.plates(serve_options))
    now = [machine.clock(), machine.priority(serve_options), machine.encoder(serve_options)]
    now += [network.port(serve_options), *network.address(serve_options)]
    now += devices.worn(serve_options)
    return [*first, *now, *audio.by(deadline), *plates.by(deadline)]


def _print(findings: list[Finding]) -> None:
    for finding in findings:
        cure = f"  -> {finding.cure}" if finding.cure else ""
        print(f"{_MARKS[finding.verdict]} {finding.about:<11} {finding.message}{cure}")
    print(f"\n{sentence(findings)}")


def sentence(findings: list[Finding]) -> str:
    """Sum up the findings for a person."""
    wrong = [finding.about for finding in findings if finding.verdict == "wrong"]
    notes = sum(finding.verdict == "note" for finding in findings)
    if wrong:
        return f"{len(wrong)} wrong ({', '.join(wrong)}): follow the advice after each arrow."
    if notes:
        s = "" if notes == 1 else "s"
        return f"Nothing is wrong; {notes} note{s} on possible improvements."
    return "Nothing is wrong: `hapticvlm serve` will start."

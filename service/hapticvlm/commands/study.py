"""`hapticvlm study`: the forced-choice study of what people feel, and its report."""

from __future__ import annotations

import argparse
import asyncio
import contextlib
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from hapticvlm.commands import study_predict

if TYPE_CHECKING:
    from hapticvlm.commands.parsing import Commands
    from hapticvlm.study.log import Design, Plan
    from hapticvlm.study.stimuli import Stimulus

_RUN = """
Serve the study page on this machine: training with pictures, then every pattern in a balanced
random order, played through a service of its own (simulated devices unless --speaker and --peltier
name others) or the one at --url. Every answer is on the disk before the next pattern; stop it
anywhere and run the same command again to go on. Exit code 2: it could not start or go on.
"""
_REPORT = """
Evaluate a study: recognition with intervals, confusion matrices, reaction times, a two-way
repeated-measures ANOVA, pairwise tests after Holm, information transmitted; pictures, a CSV of all
trials and a text go to DIR/report. With --paper, the study of the HapticVLM paper.
"""


def add(commands: Commands) -> None:
    """Declare the command with its parts."""
    study = commands.add_parser("study", help="run a study of what people feel, and report it")
    parts = study.add_subparsers(title="parts", required=True, metavar="PART")
    _add_run(parts)
    _add_report(parts)
    study_predict.add(parts)


def _add_run(parts: Commands) -> None:
    run = parts.add_parser("run", help="serve the study page", description=_RUN)
    run.set_defaults(run=_run)
    run.add_argument(
        "folder", type=Path, metavar="DIR", help="of this study; new, or to go on with"
    )
    run.add_argument(
        "--patterns",
        metavar="FILE",
        help="TOML with a [[pattern]] each, or ours, twenty, paper-like (ours)",
    )
    run.add_argument(
        "--participants", metavar="N|CODES", help="how many, or codes with commas: no names (1)"
    )
    run.add_argument("--repeats", type=int, help="of every pattern in trials (5)")
    run.add_argument("--renderings", type=int, help="of every pattern in training (3)")
    run.add_argument("--seed", type=int, help="of the orders (1)")
    run.add_argument(
        "--masking-noise", action="store_true", help="the page plays noise to headphones"
    )
    run.add_argument("--port", type=int, default=8791, help="of the page (%(default)s; 0 = any)")
    run.add_argument("--rest", type=float, default=3.0, help="between patterns, s (%(default)s)")
    run.add_argument(
        "--settle-c",
        type=float,
        default=0.8,
        help="how near to 32 degC the plate must be before a pattern (%(default)s)",
    )
    devices = run.add_argument_group("devices")
    devices.add_argument(
        "--url", help="play through this service instead, e.g. ws://127.0.0.1:8790/"
    )
    devices.add_argument("--token", help="of that service")
    devices.add_argument("--speaker", default="simulated", help="as in serve (%(default)s)")
    devices.add_argument("--peltier", default="simulated", metavar="PORT", help="as in serve")


def _add_report(parts: Commands) -> None:
    report = parts.add_parser("report", help="evaluate a study", description=_REPORT)
    report.set_defaults(run=_report)
    report.add_argument("folder", type=Path, metavar="DIR", nargs="?", help="of the study")
    report.add_argument("--paper", action="store_true", help="the paper's data instead")
    report.add_argument("--out", type=Path, metavar="FOLDER", help="for the files (DIR/report)")
    report.add_argument("--json", action="store_true", help="print one JSON document only")


def _run(options: argparse.Namespace) -> int:
    from hapticvlm.study.log import locked

    design = _design(options)
    with locked(options.folder), _service(options) as url:
        asyncio.run(_serve(design, options, url))
    return 0


def _design(options: argparse.Namespace) -> Design:
    """Read the study of this folder, or begin it. Raises StudyError."""
    from hapticvlm.study import log
    from hapticvlm.study.patterns import ours
    from hapticvlm.study.stimuli import StudyError

    if (options.folder / log.HEAD).exists():
        found = log.read_design(options.folder)
        if _wanted(options, found.stimuli, found.participants, _plan_of(found)) != found:
            raise StudyError(f"{options.folder} holds a study of another design; take a new folder")
        return found
    made = _wanted(options, ours(), ("P01",), log.Plan())
    log.write_design(options.folder, made)
    return made


def _plan_of(design: Design) -> Plan:
    from hapticvlm.study.log import Plan

    return Plan(design.repeats, design.renderings, design.seed)


def _wanted(
    options: argparse.Namespace,
    stimuli: tuple[Stimulus, ...],
    participants: tuple[str, ...],
    plan: Plan,
) -> Design:
    """Lay out what the options ask for, the rest as given. Raises StudyError."""
    from dataclasses import replace

    from hapticvlm.study import log
    from hapticvlm.study import stimuli as patterns

    if options.patterns not in (None, "default"):
        stimuli = _patterns(options.patterns)
    if options.participants is not None:
        participants = _codes(options.participants)
    asked = {name: getattr(options, name) for name in ("repeats", "renderings", "seed")}
    given = {name: value for name, value in asked.items() if value is not None}
    if not 1 <= given.get("repeats", 1) <= 100 or not 0 <= given.get("renderings", 0) <= 100:
        raise patterns.StudyError("--repeats and --renderings: at most 100, --repeats at least 1")
    return log.design(stimuli, participants, replace(plan, **given))


def _patterns(name: str) -> tuple[Stimulus, ...]:
    """Return a set of this program's by its name, or read a file. Raises StudyError."""
    from hapticvlm.study import patterns, stimuli

    named = {"ours": patterns.ours, "twenty": patterns.twenty, "paper-like": stimuli.paper_like}
    return named[name]() if name in named else stimuli.read(Path(name))


def _codes(text: str) -> tuple[str, ...]:
    from hapticvlm.study.stimuli import StudyError

    if not text.isdigit():
        return tuple(code.strip() for code in text.split(","))
    if not 1 <= int(text) <= 999:
        raise StudyError("--participants: 1 to 999")
    return tuple(f"P{number:02d}" for number in range(1, int(text) + 1))


@contextlib.contextmanager
def _service(options: argparse.Namespace) -> Iterator[str]:
    """Offer a service to play through: the one named, or one that ends with us."""
    if options.url is not None:
        yield options.url
        return
    from hapticvlm.commands.local_service import running

    given = ["--speaker", options.speaker, "--peltier", options.peltier]
    with running(given, ends_with_us=True) as service:
        yield service.url


async def _serve(design: Design, options: argparse.Namespace, url: str) -> None:
    import signal

    from hapticvlm.study.record import Pace
    from hapticvlm.study.run import Setting, run

    def ready(page: str) -> None:
        trials = len(next(iter(design.trials.values())))
        print(f"study ready on {page}", flush=True)
        print(f"  {len(design.participants)} participants, {trials} trials each", flush=True)

    pace = Pace(options.rest, masking_noise=options.masking_noise)
    setting = Setting(
        options.folder, url, options.port, pace, settle_c=options.settle_c, token=options.token
    )
    study = asyncio.create_task(run(design, setting, ready))
    with contextlib.suppress(NotImplementedError):
        asyncio.get_running_loop().add_signal_handler(signal.SIGTERM, study.cancel)
    with contextlib.suppress(asyncio.CancelledError):
        await study


def _report(options: argparse.Namespace) -> int:
    from hapticvlm.study.report import report, report_paper
    from hapticvlm.study.stimuli import StudyError

    if options.paper == (options.folder is not None):
        raise StudyError("name a study's folder, or --paper")
    if options.paper:
        text = report_paper(options.out, as_json=options.json)
    else:
        text = report(options.folder, options.out, as_json=options.json)
    print(text)
    return 0

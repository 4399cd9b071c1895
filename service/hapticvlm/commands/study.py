"""`hapticvlm study`: the forced-choice study of what people feel, and its report."""

from __future__ import annotations

import argparse
import asyncio
import contextlib
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from hapticvlm.commands import study_predict
from hapticvlm.commands.parsing import add_json
from hapticvlm.commands.reaching import port_errors

if TYPE_CHECKING:
    from hapticvlm.commands.parsing import Commands
    from hapticvlm.study.design import Design, Plan
    from hapticvlm.study.stimuli import Stimulus

_RUN = """
Serve the study page on this machine. It trains the participant with pictures, then presents every
pattern in a balanced or a free random order. The patterns are played through a service of its
own, or the one at --url. Devices are simulated unless --speaker and --peltier name others. Every
answer is on the disk before the next pattern: stop it anywhere, and run the same command again to
go on. Exit code 2: it could not start or go on.
"""
_REPORT = """
Evaluate a study: recognition with intervals, confusion matrices, reaction times, a two-way
repeated-measures ANOVA and Friedman's test of those who felt every pattern, pairwise tests after
Holm, and information transmitted. Text, pictures and a CSV file of all trials go to DIR/report.
--paper evaluates the data of the HapticVLM paper.
"""


def add(commands: Commands) -> None:
    """Declare the command with its parts."""
    study = commands.add_parser(
        "study",
        help="run a study of what people feel, and report it",
        description="Run a forced-choice study of what people feel, and evaluate it.",
    )
    parts = study.add_subparsers(title="parts", required=True, metavar="PART")
    _add_run(parts)
    _add_report(parts)
    study_predict.add(parts)


def _add_run(parts: Commands) -> None:
    run = parts.add_parser(
        "run",
        help="run a study, through a page",
        description=_RUN,
        examples=(
            "hapticvlm study run pilot --participants 9",
            "hapticvlm study run pilot --participants 9 --speaker default --peltier auto",
        ),
    )
    run.set_defaults(run=_run)
    run.add_argument(
        "folder",
        type=Path,
        metavar="DIR",
        help="folder of this study: a new one, or one to go on with",
    )
    run.add_argument(
        "--patterns",
        metavar="FILE",
        help="TOML file with [[pattern]] tables, or ours, twenty, paper-like (ours)",
    )
    run.add_argument(
        "--participants",
        metavar="N|CODES",
        help="how many, or their codes with commas between them; never names of people (1)",
    )
    run.add_argument(
        "--order",
        choices=("blocked", "free"),
        help="balanced blocks of all patterns, or one free random order (blocked)",
    )
    run.add_argument(
        "--repeats", type=int, metavar="N", help="trials of every pattern for each person (5)"
    )
    run.add_argument(
        "--renderings", type=int, metavar="N", help="times every pattern is felt in training (3)"
    )
    run.add_argument("--seed", type=int, metavar="N", help="seed of the random orders (1)")
    run.add_argument(
        "--masking-noise", action="store_true", help="the page plays noise, for headphones"
    )
    run.add_argument(
        "--port",
        type=int,
        default=8791,
        metavar="PORT",
        help="port of the page, 0 for any free one (%(default)s)",
    )
    run.add_argument(
        "--rest",
        type=float,
        default=3.0,
        metavar="S",
        help="seconds between two patterns (%(default)s)",
    )
    run.add_argument(
        "--settle-c",
        type=float,
        default=0.8,
        metavar="DEGC",
        help="how near to 32 degC the plate must be before a pattern (%(default)s)",
    )
    devices = run.add_argument_group("devices")
    devices.add_argument(
        "--url", help="play through this running service, e.g. ws://127.0.0.1:8790/"
    )
    devices.add_argument("--token", help="the secret of that service")
    devices.add_argument(
        "--speaker", default="simulated", metavar="NAME", help="as in `serve` (%(default)s)"
    )
    devices.add_argument(
        "--peltier", default="simulated", metavar="PORT", help="as in `serve` (%(default)s)"
    )


def _add_report(parts: Commands) -> None:
    report = parts.add_parser(
        "report",
        help="evaluate a study",
        description=_REPORT,
        examples=("hapticvlm study report pilot", "hapticvlm study report --paper --out paper"),
    )
    report.set_defaults(run=_report)
    report.add_argument("folder", type=Path, metavar="DIR", nargs="?", help="folder of the study")
    report.add_argument("--paper", action="store_true", help="evaluate the paper's data")
    report.add_argument(
        "--out", type=Path, metavar="FOLDER", help="write the files here (DIR/report)"
    )
    add_json(report)


def _run(options: argparse.Namespace) -> int:
    from hapticvlm.study.record import locked

    design = _design(options)
    with locked(options.folder), port_errors(options.port), _service(options) as url:
        asyncio.run(_serve(design, options, url))
    return 0


def _design(options: argparse.Namespace) -> Design:
    """Read the study of this folder, or begin it. Raises StudyError."""
    from hapticvlm.study import design
    from hapticvlm.study.patterns import ours
    from hapticvlm.study.stimuli import StudyError

    if (options.folder / design.HEAD).exists():
        found = design.read_design(options.folder)
        if _wanted(options, found.stimuli, found.participants, _plan_of(found)) != found:
            raise StudyError(f"{options.folder} holds a study of another design; take a new folder")
        return found
    made = _wanted(options, ours(), ("P01",), design.Plan())
    design.write_design(options.folder, made)
    return made


def _plan_of(design: Design) -> Plan:
    from hapticvlm.study.design import Plan

    return Plan(design.repeats, design.renderings, design.seed, design.order)


def _wanted(
    options: argparse.Namespace,
    stimuli: tuple[Stimulus, ...],
    participants: tuple[str, ...],
    plan: Plan,
) -> Design:
    """Lay out what the options ask for, the rest as given. Raises StudyError."""
    from dataclasses import replace

    from hapticvlm.study.design import design
    from hapticvlm.study.stimuli import StudyError

    if options.patterns not in (None, "default"):
        stimuli = _patterns(options.patterns)
    if options.participants is not None:
        participants = _codes(options.participants)
    asked = {name: getattr(options, name) for name in ("repeats", "renderings", "seed", "order")}
    given = {name: value for name, value in asked.items() if value is not None}
    if not 1 <= given.get("repeats", 1) <= 100 or not 0 <= given.get("renderings", 0) <= 100:
        raise StudyError("--repeats and --renderings: at most 100, --repeats at least 1")
    return design(stimuli, participants, replace(plan, **given))


def _patterns(name: str) -> tuple[Stimulus, ...]:
    """Return a set of this program's by its name, or read a file. Raises StudyError."""
    from hapticvlm.study import patterns, stimuli

    named = {"ours": patterns.ours, "twenty": patterns.twenty, "paper-like": patterns.paper_like}
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
    from hapticvlm.commands.progress import working
    from hapticvlm.study.report import report, report_paper
    from hapticvlm.study.stimuli import StudyError

    if options.paper == (options.folder is not None):
        raise StudyError("name a study's folder, or --paper")
    with working("evaluating the study"):
        if options.paper:
            text = report_paper(options.out, as_json=options.json)
        else:
            text = report(options.folder, options.out, as_json=options.json)
    print(text)
    return 0

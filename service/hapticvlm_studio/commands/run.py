"""`hapticvlm study run`: serves the pages of a study and plays its patterns."""

from __future__ import annotations

import argparse
import contextlib
import json
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from hapticvlm.commands.parsing import add_json
from hapticvlm.commands.service_address import port_errors

if TYPE_CHECKING:
    from hapticvlm.commands.parsing import Commands
    from hapticvlm_studio.design.design import Design
    from hapticvlm_studio.design.form import StudyFile

_RUN = """
Serve the study page on this machine. It trains the participant with pictures, then presents every
pattern in a balanced or a free random order. A service of its own plays the patterns, or the one at
--url. Devices are simulated unless --speaker and --peltier name others. Every answer is on the disk
before the next pattern: stop the command at any time and run it again to continue. DIR/study.toml,
written by `hapticvlm study new`, has the plan of the study. Exit code 2: the study could not start
or continue.
"""


def add(parts: Commands) -> None:
    """Declare `study run`."""
    run = parts.add_parser(
        "run",
        help="run a study in the browser",
        description=_RUN,
        examples=(
            "hapticvlm study run pilot --hear",
            "hapticvlm study run mystudy --speaker default --peltier auto",
        ),
    )
    run.set_defaults(run=_run)
    run.add_argument(
        "folder",
        type=Path,
        metavar="DIR",
        help="folder of the study, to be begun or continued",
    )
    run.add_argument(
        "--hear",
        action="store_true",
        help="play the vibration in the page, to try a study without a device",
    )
    run.add_argument(
        "--port",
        type=int,
        default=8791,
        metavar="PORT",
        help="port of the page; 0: any free port (%(default)s)",
    )
    add_json(run)
    devices = run.add_argument_group("devices")
    devices.add_argument(
        "--url", help="play through this running service, for example ws://127.0.0.1:8790/"
    )
    devices.add_argument("--token", help="token of that service")
    devices.add_argument(
        "--speaker", default="simulated", metavar="NAME", help="as in `serve` (%(default)s)"
    )
    devices.add_argument(
        "--peltier", default="simulated", metavar="PORT", help="as in `serve` (%(default)s)"
    )


def _run(options: argparse.Namespace) -> int:
    import asyncio

    from hapticvlm_studio.design.layout import layout
    from hapticvlm_studio.trials.record import locked

    design, file = layout(options.folder)
    with locked(options.folder), port_errors(options.port), _service(options) as url:
        asyncio.run(_serve(design, file, options, url))
    return 0


@contextlib.contextmanager
def _service(options: argparse.Namespace) -> Iterator[str]:
    """Yield the address of a service: that of --url, or one started here that ends with us."""
    if options.url is not None:
        yield options.url
        return
    from hapticvlm.client.local_service import running

    arguments = ["--speaker", options.speaker, "--peltier", options.peltier]
    with running(arguments) as service:
        yield service.url


async def _serve(design: Design, file: StudyFile, options: argparse.Namespace, url: str) -> None:
    import asyncio
    import signal

    from hapticvlm_studio.trials.page_server import EXPERIMENTER, PAGE, Setting, run
    from hapticvlm_studio.trials.record import Pace

    def ready(page: str) -> None:
        trials = len(next(iter(design.trials.values())))
        people = len(design.participants)
        experimenter = page.replace(PAGE, EXPERIMENTER)
        if options.json:
            addresses = {"page": page, "experimenter": experimenter}
            print(json.dumps({**addresses, "participants": people, "trials": trials}), flush=True)
            return
        print(f"study ready on {page}", flush=True)
        size = f"{people} participants, {trials} trials each" if people > 1 else f"{trials} trials"
        print(f"  {size}", flush=True)
        print(f"  for the experimenter: {experimenter}", flush=True)

    pace = Pace(
        rest_s=file.rest_s, masking_noise=file.masking_noise and not options.hear, hear=options.hear
    )
    setting = Setting(
        options.folder, url, options.port, pace, settle_c=file.settle_c, token=options.token
    )
    study = asyncio.create_task(run(design, setting, ready))
    with contextlib.suppress(NotImplementedError):
        asyncio.get_running_loop().add_signal_handler(signal.SIGTERM, study.cancel)
    with contextlib.suppress(asyncio.CancelledError):
        await study

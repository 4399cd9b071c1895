"""`hapticvlm stop` stops the outputs of a running service, from any terminal."""

from __future__ import annotations

import argparse
import json
from typing import TYPE_CHECKING

from hapticvlm.commands import service_address
from hapticvlm.commands.parsing import add_json

if TYPE_CHECKING:
    from hapticvlm.commands.parsing import Commands

SCOPES = {
    "all": "the vibration has ended and the current of the plate is cut",
    "speaker": "the vibration has ended",
    "peltier": "the current of the plate is cut",
}

_DESCRIPTION = """
Stop the outputs of a running service at once, whichever scene drives them. The vibration ends and
the current of the plate is cut. Both stay off until the scene that owns them begins a new touch.
The service itself keeps running. Exit code 0: stopped; 2: no service was reached, or it refused.
"""


def add(commands: Commands) -> None:
    """Declare the command and its options."""
    stop = commands.add_parser(
        "stop",
        help="stop the outputs of a running service at once",
        description=_DESCRIPTION,
        examples=(
            "hapticvlm stop",
            "hapticvlm stop speaker",
            "hapticvlm stop --url wss://vr-lab.local:8790/ --ca authority.pem",
        ),
    )
    stop.set_defaults(run=_stop)
    stop.add_argument(
        "scope",
        nargs="?",
        default="all",
        choices=tuple(SCOPES),
        help="outputs to stop: %(choices)s (%(default)s)",
    )
    service_address.add_options(stop)
    add_json(stop)


def _stop(options: argparse.Namespace) -> int:
    import asyncio

    asyncio.run(_ask(options))
    if options.json:
        print(json.dumps({"stopped": options.scope}))
        return 0
    print(f"stopped: {SCOPES[options.scope]}; a new touch starts them again")
    return 0


async def _ask(options: argparse.Namespace) -> None:
    """Send `stop` and wait for the answer. Raises Refused, UsageError."""
    with service_address.reaching(options.url, result="nothing was stopped; "):
        async with service_address.connecting(options, "hapticvlm stop", "observer") as client:
            await client.stop(options.scope)

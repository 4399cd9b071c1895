"""`hapticvlm serve`: runs the service a scene connects to."""

from __future__ import annotations

import argparse
import logging
import sys
from typing import TYPE_CHECKING

from hapticvlm.commands import serve_options

if TYPE_CHECKING:
    from hapticvlm.commands.parsing import Commands


def add(commands: Commands) -> None:
    """Declare the command and its options."""
    serve = commands.add_parser("serve", help="run the service a scene connects to")
    add_options(serve)


def add_options(parser: argparse.ArgumentParser, *, but: tuple[str, ...] = ()) -> None:
    """Have the command run the service, with all options `but` those it declares itself."""
    parser.set_defaults(run=_serve)
    serve_options.add(parser, but=but)


def _serve(options: argparse.Namespace) -> int:
    import asyncio

    from hapticvlm.commands import assemble
    from hapticvlm.devices.peltier import DeviceError
    from hapticvlm.processes.supervised import ChildError

    if options.log_level == "warning":
        logging.getLogger("hapticvlm").setLevel(logging.INFO)
    logging.getLogger("websockets").setLevel(logging.WARNING)
    try:
        serving = serve_options.settle(options)
        asyncio.run(assemble.run(serving, assemble.address(serving)))
    except (ValueError, OSError, ChildError, DeviceError) as error:
        print(f"hapticvlm serve: {error}", file=sys.stderr)
        return 2
    return 0

"""`hapticvlm serve`: runs the service a scene connects to."""

from __future__ import annotations

import argparse
import logging
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from hapticvlm.cli import serve_options

if TYPE_CHECKING:
    from hapticvlm.cli import Commands


def add(commands: Commands) -> None:
    """Declare the command and its options."""
    serve = commands.add_parser("serve", help="run the service a scene connects to")
    serve.add_argument(
        "--record", type=Path, metavar="FOLDER", help="keep each session in a sub-folder"
    )
    add_options(serve)


def add_options(parser: argparse.ArgumentParser) -> None:
    """Declare the options that serving has under any name, and that it serves."""
    parser.set_defaults(run=_serve)
    serve_options.add(parser)


def _serve(options: argparse.Namespace) -> int:
    import asyncio

    from hapticvlm.child import ChildError
    from hapticvlm.cli import service
    from hapticvlm.devices.peltier import DeviceError
    from hapticvlm.server.edge import Address

    if options.log_level == "warning":
        logging.getLogger("hapticvlm").setLevel(logging.INFO)
    logging.getLogger("websockets").setLevel(logging.WARNING)
    try:
        origins = frozenset(options.allow_origin)
        address = Address(options.host, options.port, options.token, origins, options.scene)
        serve_options.check_ranges(options)
        asyncio.run(service.run(options, address))
    except (ValueError, OSError, ChildError, DeviceError) as error:
        print(f"hapticvlm serve: {error}", file=sys.stderr)
        return 2
    return 0

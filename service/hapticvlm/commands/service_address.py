"""The options with which commands reach a running service: address, token, trusted authority.

It also turns the error of a port in use into one line.
"""

from __future__ import annotations

import contextlib
import errno
import os
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from hapticvlm.errors import UsageError

if TYPE_CHECKING:
    import argparse

    from hapticvlm.client.stream import Target

DEFAULT_URL = "ws://127.0.0.1:8790/"


def add_options(parser: argparse.ArgumentParser) -> None:
    """Declare --url, --token and --ca."""
    parser.add_argument("--url", default=DEFAULT_URL, help="address of the service (%(default)s)")
    parser.add_argument(
        "--token", help="token of the service (the environment variable HAPTICVLM_TOKEN)"
    )
    parser.add_argument(
        "--ca",
        type=Path,
        metavar="FILE",
        help="for wss://, trust the certificate authority in this PEM file",
    )


def target(options: argparse.Namespace) -> Target:
    """Return the service that the options name."""
    from hapticvlm.client.stream import Target

    return Target(options.url, options.token or os.environ.get("HAPTICVLM_TOKEN"), options.ca)


@contextlib.contextmanager
def port_errors(port: int) -> Iterator[None]:
    """Turn the error of a port in use into a UsageError that says what to do."""
    try:
        yield
    except OSError as error:
        if error.errno != errno.EADDRINUSE:
            raise
        raise UsageError(
            f"port {port} is in use (`hapticvlm doctor` shows by which program); stop that "
            "program, or use any free port: --port 0"
        ) from None

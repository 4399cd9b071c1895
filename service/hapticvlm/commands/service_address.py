"""The options with which commands reach a running service: address, token, trusted authority.

It also turns the error of an address that cannot be used into one line.
"""

from __future__ import annotations

import contextlib
import errno
import os
import socket
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from hapticvlm.errors import UsageError
from hapticvlm.server.addresses import ADDRESSES

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
def port_errors(port: int, host: str = "127.0.0.1") -> Iterator[None]:
    """Turn the error of an address that cannot be listened at into a UsageError with its cure."""
    try:
        yield
    except OSError as error:
        if error.errno == errno.EADDRINUSE:
            cause = "is in use (`hapticvlm doctor` shows by which program); stop that program, or"
            problem = f"port {port} {cause} use any free port: --port 0"
        elif error.errno == errno.EACCES and 0 < port < 1024:  # which root alone may use
            problem = f"port {port} is for the system; use one of 1024..65535"
        elif error.errno == errno.EADDRNOTAVAIL or isinstance(error, socket.gaierror):
            problem = f"--host {host}: {error.strerror}; {ADDRESSES}"
        else:
            raise
        raise UsageError(problem) from None

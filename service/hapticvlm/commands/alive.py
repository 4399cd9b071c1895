"""`python -m hapticvlm.commands.alive` reports whether a container's service is alive.

A container image's HEALTHCHECK runs it. It requests `/healthz` from the service that process 1
runs, at the host, port and scheme on that process's own command line. A fault of the plate does not
count: a restart would not help (`/readyz` reports it).
"""

from __future__ import annotations

import argparse
import ssl
import sys
import urllib.request
from collections.abc import Sequence
from pathlib import Path

from hapticvlm.commands import serve
from hapticvlm.server.settings import ServeOptions

COMMAND_LINE = Path("/proc/1/cmdline")
ANYWHERE = ("0.0.0.0", "::")
TIMEOUT_S = 2.0


def address(words: Sequence[str]) -> str:
    """Return the health address of the service that was started with these words."""
    parser = argparse.ArgumentParser(add_help=False)
    serve.add_flags(parser)
    after = words.index("serve") + 1 if "serve" in words else len(words)
    options: ServeOptions = serve.resolve_options(parser.parse_known_args(words[after:])[0])
    scheme = "http" if options.tls_cert is None else "https"
    host = "127.0.0.1" if options.host in ANYWHERE else options.host
    return f"{scheme}://{f'[{host}]' if ':' in host else host}:{options.port}/healthz"


def main() -> int:
    """Return 0 if the service is alive, 1 if it is not."""
    # No secret is sent, and only the fact of an answer is used: any certificate will do.
    context = ssl.create_default_context()
    context.check_hostname = False
    context.verify_mode = ssl.CERT_NONE
    try:
        words = COMMAND_LINE.read_bytes().decode().split("\0")[:-1]
        with urllib.request.urlopen(address(words), timeout=TIMEOUT_S, context=context):
            return 0
    except (OSError, ValueError) as error:
        print(error, file=sys.stderr)
        return 1


if __name__ == "__main__":
    sys.exit(main())

"""Where this service's pages can be opened from, and a code of that address for a camera."""

from __future__ import annotations

import io
import socket
from contextlib import closing

import segno

from hapticvlm.server.lan_pages import LanPages

ANYWHERE = ("192.0.2.1", 9)  # TEST-NET-1 (RFC 5737): nothing is sent to it
HERE_ONLY = (
    "Pages go to this machine only. For a phone or headset start "
    "`hapticvlm serve --host 0.0.0.0 --token SECRET --pages-from lan`."
)


def of_pages(lan_pages: LanPages | None, port: int) -> dict[str, str | None]:
    """Report where others of the local network open the pages, or why they cannot."""
    if lan_pages is None:
        return {"page": None, "why": HERE_ONLY}
    return {"page": f"{lan_pages.scheme}://{_own_address()}:{port}/", "why": None}


def code(page: str) -> str:
    """Draw an address as a QR code (ISO/IEC 18004), SVG."""
    drawn = io.BytesIO()
    segno.make(page, error="m").save(drawn, kind="svg", scale=8, border=2, xmldecl=False)
    return drawn.getvalue().decode()


def _own_address() -> str:
    """Return this machine's address in its network, or its name where it has none."""
    with closing(socket.socket(socket.AF_INET, socket.SOCK_DGRAM)) as probe:
        try:
            probe.connect(ANYWHERE)
            return str(probe.getsockname()[0])
        except OSError:
            return socket.gethostname()

"""What the service says when it is ready: its addresses, its devices, who can listen in."""

from __future__ import annotations

import contextlib
import socket
from collections.abc import Iterator

from hapticvlm import __version__
from hapticvlm.commands.serve_config import Serving
from hapticvlm.messages import Devices
from hapticvlm.server.http import is_loopback


def say(serving: Serving, port: int, devices: Devices, *, has_priority: bool) -> None:
    """Print where the service listens (on `port`) and what it drives."""
    shown = f"[{serving.host}]" if ":" in serving.host else serving.host
    s = "" if serving.tls_cert is None else "s"
    print(f"hapticvlm {__version__} ready on ws{s}://{shown}:{port}/", flush=True)
    print(f"  status page  http{s}://{shown}:{port}/")
    for line in _network(serving, f"ws{s}", port):
        print(line)
    for label, device in (("speaker", devices.speaker), ("plate", devices.peltier)):
        print(f"  {label:<12} {device.name}{' (simulated)' if device.simulated else ''}")
    print(f"  priority     {'real-time' if has_priority else 'normal'}", flush=True)
    if serving.vlm_url is not None:
        print(f"  vlm          {serving.vlm_url}: frames are sent there", flush=True)
    elif serving.vlm is not None:
        print(f"  vlm          {serving.vlm or 'the default'}, loading", flush=True)


def _network(serving: Serving, scheme: str, port: int) -> Iterator[str]:
    """Say what others on the network use, how they see pages, and who can read along."""
    if is_loopback(serving.host):
        return
    own = _own_address() if serving.host in ("0.0.0.0", "::") else None
    if own is not None:
        yield f"  from others  {scheme}://{own}:{port}/"
    if serving.pages_from == "lan":
        yield "  pages        for the local network too: any name, the token as password"
    if serving.tls_cert is None:
        yield "  unencrypted  the network can read along, the token too: see --tls-cert"


def _own_address() -> str | None:
    """Return the address the network knows this machine by, without sending anything."""
    with contextlib.suppress(OSError), socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.connect(("192.0.2.1", 9))  # of TEST-NET-1, RFC 5737; UDP only picks the interface
        return str(probe.getsockname()[0])
    return None

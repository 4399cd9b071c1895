"""The example scene in the user's own browser, served by a service on simulated devices."""

from __future__ import annotations

import sys
import time
import webbrowser
from pathlib import Path

from hapticvlm.commands.local_service import ending_on_sigterm, running
from hapticvlm.errors import UsageError

EXAMPLES = "examples"
CURE = "npm ci --prefix examples/webxr"


def run() -> int:
    """Serve the scene, open it, and stay until Ctrl+C. Raises UsageError, ServiceError."""
    examples = _examples()
    if examples is None:
        raise UsageError("no examples/webxr here: run this in a checkout")
    if not (examples / "webxr" / "node_modules" / "three").is_dir():
        raise UsageError(f"three.js is not installed: {CURE}")
    try:
        with (
            ending_on_sigterm(),
            running(["--scene", str(examples)], ends_with_us=True) as service,
        ):
            page = service.page + "scene/webxr/"
            print(f"the scene    {page}\ndashboard    {service.page}\nCtrl+C ends both", flush=True)
            if not webbrowser.open(page):
                print("no browser opened by itself: open the first address in one", flush=True)
            while service.process.poll() is None:
                time.sleep(0.5)
    except KeyboardInterrupt:
        return 0
    print("hapticvlm demo: the service ended by itself", file=sys.stderr)
    return 1


def _examples() -> Path | None:
    for folder in (Path.cwd(), Path(__file__).resolve().parents[4]):
        if (folder / EXAMPLES / "webxr" / "index.html").is_file():
            return folder / EXAMPLES
    return None

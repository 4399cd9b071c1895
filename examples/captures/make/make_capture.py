"""Records the example capture: a three.js scene in an emulated WebXR headset session.

Serves the page on loopback, opens it in headless Chromium, and asks it for one frame at a time.
The page controls simulated time; this script handles files and formats, not the scene.
"""

from __future__ import annotations

import argparse
import base64
import functools
import http.server
import json
import shutil
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from PIL import Image
from playwright.sync_api import JSHandle, sync_playwright

MAKE = Path(__file__).resolve().parent
LIVING_ROOM = MAKE.parent / "living_room"
CHROMIUM = "chromium"
LLVMPIPE_FLAGS = ("--use-gl=angle", "--use-angle=gl-egl", "--ignore-gpu-blocklist")
# The first frame compiles every shader on the CPU.
FRAME_TIMEOUT_MS = 120_000


@dataclass(frozen=True)
class Recorded:
    """The written capture: counts and the total size of its files."""

    frames: int
    touches: int
    duration_s: float
    size_bytes: int


def main() -> None:
    """Record to a folder and print what was recorded."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--out", type=Path, default=LIVING_ROOM, help="folder, replaced")
    parser.add_argument("--seconds", type=float, help="stop after this much simulated time")
    parser.add_argument("--script", default="living_room", choices=("living_room", "demo"))
    arguments = parser.parse_args()
    print(record(arguments.out, arguments.seconds, arguments.script))


def missing() -> str | None:
    """Return what must be installed before `record` can run, or None."""
    if shutil.which(CHROMIUM) is None:
        return (
            "no chromium: apt-get install --no-install-recommends "
            "chromium libgl1-mesa-dri libegl-mesa0 libegl1"
        )
    if not (MAKE / "node_modules" / "iwer").is_dir():
        return "no browser packages: npm ci --prefix examples/captures/make"
    return None


def record(folder: Path, seconds: float | None = None, script: str = "living_room") -> Recorded:
    """Write a capture of the whole script, or of its first seconds, to a folder."""
    if reason := missing():
        raise SystemExit(reason)
    for part in ("frames", "masks"):
        shutil.rmtree(folder / part, ignore_errors=True)
        (folder / part).mkdir(parents=True)
    lines: list[dict[str, Any]] = []
    with _session(script) as session:
        end = min(seconds or float("inf"), session.evaluate("page => page.duration"))
        lines.append(session.evaluate("page => page.sceneMessage()"))
        number = 0
        while lines[-1]["t_s"] + 1e-6 < end:
            number += 1
            lines += _next_frame(session, folder, number)
    text = "".join(json.dumps(line, separators=(",", ":")) + "\n" for line in lines)
    (folder / "capture.jsonl").write_text(text, encoding="utf-8")
    return Recorded(
        frames=number,
        touches=sum(line.get("phase") == "contact" and "interaction" in line for line in lines),
        duration_s=lines[-1]["t_s"],
        size_bytes=sum(path.stat().st_size for path in folder.rglob("*") if path.is_file()),
    )


def _next_frame(session: JSHandle, folder: Path, number: int) -> list[dict[str, Any]]:
    """Advance the page by one frame, write its pictures and return its messages."""
    shot = session.evaluate("page => page.next()")
    messages: list[dict[str, Any]] = shot["messages"]
    frame = messages[-1]
    frame["file"] = f"frames/{number:04d}.jpg"
    (folder / frame["file"]).write_bytes(base64.b64decode(shot["jpeg"]))
    if shot["mask"] is not None:
        frame["mask_file"] = f"masks/{number:04d}.png"
        size = (frame["width"], frame["height"])
        mask = Image.frombytes("L", size, base64.b64decode(shot["mask"]))
        mask.save(folder / frame["mask_file"], optimize=True)
    return messages


@contextmanager
def _session(script: str) -> Iterator[JSHandle]:
    """Open the page and enter its immersive session; yield the page's exports."""
    with _served() as address, sync_playwright() as playwright:
        browser = playwright.chromium.launch(
            executable_path=shutil.which(CHROMIUM), args=["--no-sandbox", *LLVMPIPE_FLAGS]
        )
        try:
            page = browser.new_page(viewport={"width": 224, "height": 112})
            page.set_default_timeout(FRAME_TIMEOUT_MS)
            page.goto(f"{address}/page/index.html?script={script}")
            session = page.evaluate_handle("import('./main.js')")
            session.evaluate("page => page.enter()")
            yield session
        finally:
            browser.close()


@contextmanager
def _served() -> Iterator[str]:
    """Serve this folder on a free loopback port."""
    handler = functools.partial(_Quiet, directory=str(MAKE))
    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
        thread = threading.Thread(target=server.serve_forever, daemon=True)
        thread.start()
        try:
            yield f"http://127.0.0.1:{server.server_port}"
        finally:
            server.shutdown()
            thread.join()


class _Quiet(http.server.SimpleHTTPRequestHandler):
    def log_message(self, format: str, *args: Any) -> None:
        """Do not log successful requests."""


if __name__ == "__main__":
    main()

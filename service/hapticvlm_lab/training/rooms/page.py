"""The page that draws rooms, in a headless Chromium: pictures with their truth, by seed.

It can load three.js and those files of the data folder that may teach; no other file, no network.
"""

from __future__ import annotations

import base64
import os
import shutil
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import numpy as np
from numpy.typing import NDArray
from playwright.sync_api import Error, Page, Route, sync_playwright

from hapticvlm_lab.training import sources

HERE = Path(__file__).parent
THREE = HERE / "node_modules" / "three"
ADDRESS = "http://rooms.invalid"
# Mesa's rasteriser; the default, SwiftShader, is 3 to 6 times slower.
FLAGS = ("--no-sandbox", "--use-gl=angle", "--use-angle=gl-egl", "--ignore-gpu-blocklist")
PATIENCE_MS = 300_000  # the first room compiles its shaders on the processor
FOLDERS = "hdri brick ceramic concrete fabric foliage metal paper plastic rubber stone wood"


class RoomsError(Exception):
    """Raised when rooms cannot be drawn; the text says what is missing, and what to do."""


@dataclass(frozen=True, slots=True)
class Picture:
    """A thing of a room: pixels (H, W, 3) uint8 RGB, and a mask (H, W) of where it is seen.

    `id` is its number in the room, from 1; `label` its material or "unknown".
    """

    pixels: NDArray[np.uint8]
    mask: NDArray[np.bool_]
    id: int
    label: str


@dataclass(frozen=True, slots=True)
class Rooms:
    """An open page. The same seed gives the same pictures on the same machine."""

    page: Page

    def crops(self, seed: int, views: int = 6) -> list[Picture]:
        """Draw single things of a room, up to 224 px a side, cut from frames of a headset."""
        return self._shots(seed, f"rooms.make({seed:d}, {views:d})")

    def take(self, props: Sequence[tuple[str, str]]) -> None:
        """Load (file, label) of a kit, in place of the kit before. Raises RoomsError."""
        files = [{"file": file, "label": label} for file, label in props]
        try:
            self.page.evaluate("files => rooms.take(files)", files)
        except Error as error:
            raise RoomsError(
                f"{props[0][0]} and others: {error.message.splitlines()[0]}"
            ) from error

    def place(self, seed: int, shown: Sequence[int], beside: Sequence[int]) -> list[Picture]:
        """Draw crops of the props `shown`, in a room with those `beside`, each the subject once.

        Both are places in what was taken; thing n of a picture is the prop shown[n - 1].
        """
        return self._shots(seed, f"rooms.place({seed:d}, {list(shown)}, {list(beside)})")

    def _shots(self, seed: int, call: str) -> list[Picture]:
        try:
            shots = self.page.evaluate(call)
        except Error as error:
            raise RoomsError(f"room {seed}: {error.message.splitlines()[0]}") from error
        return [_picture(**shot) for shot in shots]


def _picture(size: tuple[int, int], pixels: str, **thing: Any) -> Picture:
    rows = np.frombuffer(base64.b64decode(pixels), np.uint8).reshape(size[1], size[0], 4)[::-1]
    return Picture(rows[..., :3].copy(), rows[..., 3] == thing["id"], **thing)


@contextmanager
def opened(data: Path, kits: Sequence[Path] = ()) -> Iterator[Rooms]:
    """Open the page on a data folder, and on the files of `kits` in it. Raises RoomsError."""
    teaching_files = teaching(data)
    chromium = shutil.which("chromium")
    if chromium is None:
        raise RoomsError("Chromium is missing: apt-get install chromium libegl1 libgl1-mesa-dri")
    if not THREE.is_dir():
        raise RoomsError(f"three.js is missing: npm ci --prefix {os.path.relpath(HERE)}")
    env: dict[str, str | float | bool] = {
        "LP_NUM_THREADS": "1",
        **os.environ,
    }  # threads of the rasteriser
    allowed = {f"/data/{name}": data / name for names in teaching_files.values() for name in names}
    files = [path for kit in kits for path in sorted(kit.iterdir())]
    allowed |= {f"/data/{path.relative_to(data).as_posix()}": path for path in files}
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium, args=FLAGS, env=env)
        try:
            page = browser.new_page()
            page.set_default_timeout(PATIENCE_MS)
            page.route("**/*", lambda route: _answer(route, allowed))
            page.goto(f"{ADDRESS}/web/index.html")
            page.wait_for_function("window.rooms")
            page.evaluate("files => rooms.open(files)", teaching_files)
            yield Rooms(page)
        finally:
            browser.close()


def teaching(data: Path) -> dict[str, list[str]]:
    """List tiles by folder, and skies, that may teach. Raises RoomsError for an empty folder."""
    files: dict[str, list[str]] = {name: [] for name in FOLDERS.split()}
    tiles = data.glob("ambientcg_tiles/*/*.jpg")
    skies = data.glob("hdri/*_512.hdr")
    shown = [path for path in tiles if not sources.is_tile_held_back(path.name)]
    lit = [path for path in skies if path.name[: -len("_512.hdr")] not in sources.HDRI_HELD_BACK]
    for path in sorted([*shown, *lit]):
        if path.parent.name in files:
            files[path.parent.name].append(path.relative_to(data).as_posix())
    if empty := [name for name, paths in files.items() if not paths]:
        raise RoomsError(f"{data}: no teaching pictures in {', '.join(empty)}")
    return files


def _answer(route: Route, allowed: dict[str, Path]) -> None:
    name = urlsplit(route.request.url).path
    own = THREE / name[7:] if name.startswith("/three/") else HERE / name[1:]
    path = allowed.get(name, own)
    if path.is_file():
        return route.fulfill(path=path)
    return route.fulfill(status=404)

"""The Godot sample in a real engine: the official web template of Godot 4.6 in headless Chromium.

The engine, its physics, its renderer (on the processor), the WebSocket and the service are real;
the mouse is scripted, speaker and plate are simulated.
"""

from __future__ import annotations

import io
import json
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import msgpack
from drawn_textures import planks, weave
from godot_pack import TEMPLATE, project_files, write_game
from headless import LLVMPIPE, chromium
from pace import PACE
from PIL import Image
from scene_cases import of_clients

from hapticvlm.client.local_service import Service, running
from hapticvlm.vision.pictures import Pixels

HERE = Path(__file__).parent
PROJECT = HERE.parents[1] / "examples" / "godot"
SIZE = (480, 300)
TEXTURE_PX = 512
PATIENCE_S = 120.0 * PACE  # shaders are compiled and drawn on a processor that others use too
AUTOLOAD = "[autoload]\n"
PROBE = 'Probe="*res://probe.gd"\n'

Event = dict[str, Any]
# A scene of the addon is made of single objects, so that an id described twice is a change of it.
ADDED = [case for case in of_clients() if case["name"] != "an id that is there twice"]


def sample(project: Path = PROJECT) -> dict[str, bytes]:
    """Return the files of the sample, or of a project like it, with the tests' probe."""
    files = project_files(project)
    settings = files["project.godot"].decode()
    heading, autoloads = settings.split(AUTOLOAD)
    first, rest = autoloads.split("\n\n[", 1)  # after the connection, which it listens to
    files["project.godot"] = f"{heading}{AUTOLOAD}{first}\n{PROBE}\n[{rest}".encode()
    files["probe.gd"] = (HERE / "godot_probe.gd").read_bytes()
    files["room.gd"] = (HERE / "godot_room.gd").read_bytes()
    for draw in (planks, weave):
        files[f"{draw.__name__}.png"] = _png(draw(TEXTURE_PX))
    files["scene_cases.json"] = json.dumps(ADDED).encode()
    return files


def _png(pixels: Pixels) -> bytes:
    file = io.BytesIO()
    Image.fromarray(pixels).save(file, "PNG")
    return file.getvalue()


@dataclass
class Game:
    """The sample as it runs, and what its probe and the browser have said."""

    page: Any
    service: Service
    events: list[Event] = field(default_factory=list)
    complaints: list[str] = field(default_factory=list)
    places: dict[str, list[float]] = field(
        default_factory=dict
    )  # of objects, in shares of the page
    frames: list[Event] = field(default_factory=list)  # as they went over the wire
    told: list[Event] = field(default_factory=list)  # all other messages that did

    def watch(self, socket: Any) -> None:
        """Keep what goes out through a WebSocket."""
        socket.on("framesent", self._sent)

    def _sent(self, data: str | bytes) -> None:
        if isinstance(data, bytes):
            self.frames.append(msgpack.unpackb(data))
        else:
            self.told.append(json.loads(data))

    def hear(self, said: Any) -> None:
        """Take one line of the browser's console."""
        text = said.text
        if text.startswith("PROBE "):
            self.events.append(json.loads(text.removeprefix("PROBE ")))
        elif said.type == "error":
            self.complaints.append(text)

    def wait_for(self, what: str, since: int = 0, **wanted: Any) -> Event:
        """Return the first event of this kind with these values. Raises TimeoutError."""
        end = time.monotonic() + PATIENCE_S
        while self._runs() and time.monotonic() < end:
            for event in self.events[since:]:
                if event["what"] == what and wanted.items() <= event["detail"].items():
                    found: Event = event["detail"]
                    return found
            self.page.wait_for_timeout(50)
        raise TimeoutError(f"no {what} {wanted}; {self.events[-3:]} {self.complaints[-3:]}")

    def wait_to_tell(self, since: int, **wanted: Any) -> Event:
        """Return the first message sent after so many with these values. Raises TimeoutError."""
        end = time.monotonic() + PATIENCE_S
        while self._runs() and time.monotonic() < end:
            for message in self.told[since:]:
                if wanted.items() <= message.items():
                    return message
            self.page.wait_for_timeout(50)
        raise TimeoutError(f"nothing sent like {wanted}; {self.told[-3:]}")

    def _runs(self) -> bool:
        """Return that no script was refused; a scene without one would be waited for in vain."""
        refused = [text for text in self.complaints if "SCRIPT ERROR" in text]
        assert refused == [], refused
        return True

    def state(self) -> Event:
        """Return the state that the probe tells next."""
        return self.wait_for("state", len(self.events))

    def point(self, object_id: str, *, dx: float = 0.0) -> None:
        """Move the mouse onto an object, or a share `dx` of the page beside its middle."""
        x, y = self.places[object_id]
        self.page.mouse.move(SIZE[0] * (x + dx), SIZE[1] * y)

    def touch(self, object_id: str) -> Event:
        """Touch an object with the mouse until it is decided; return the decision."""
        began = len(self.events)
        self.point(object_id)
        self.page.mouse.down()
        self.wait_for("touched", began, id=object_id)
        decision = self.wait_for("decided", object_id=object_id)
        self.stroke(object_id)
        self.page.mouse.up()
        self.wait_for("released", began)
        return decision

    def stroke(self, object_id: str, times: int = 4) -> None:
        """Move the mouse to and fro on what it touches."""
        for i in range(times):
            self.point(object_id, dx=0.012 * (-1) ** i)
            self.page.wait_for_timeout(100)


@contextmanager
def playing(files: dict[str, bytes]) -> Iterator[Game]:
    """Serve a game by the service itself, and open it."""
    with (  # beside the template, so that 38 MB are linked and not copied
        tempfile.TemporaryDirectory(dir=TEMPLATE.parents[1], prefix="scene-") as folder,
        running(["--scene", folder]) as service,
        chromium(*LLVMPIPE) as browser,
    ):
        write_game(Path(folder), files)
        page = browser.new_page(viewport={"width": SIZE[0], "height": SIZE[1]})
        page.set_default_timeout(1000 * PATIENCE_S)
        game = Game(page, service)
        page.on("console", game.hear)
        page.on("websocket", game.watch)
        page.on("pageerror", lambda error: game.complaints.append(f"SCRIPT ERROR: {error}"))
        page.goto(f"{service.page}scene/")
        yield game

"""What is fuzzed: for each kind of input, the code that takes it and the errors it may raise.

A target takes bytes and a scratch file. Any other error is a finding, as is an output that moved.
"""

from __future__ import annotations

import contextlib
import itertools
import json
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from plain_words import require_plain

from hapticvlm.captures.lines import CaptureError, read_lines
from hapticvlm.commands import config_file
from hapticvlm.devices.plate import protocol as plate_protocol
from hapticvlm.devices.plate.framing import Deframer
from hapticvlm.devices.plate.session import PlateSession
from hapticvlm.devices.speaker.audio import read_wav
from hapticvlm.materials import MATERIALS, MaterialError
from hapticvlm.messages import Frame, MessageError, Touch
from hapticvlm.partial_messages import decode
from hapticvlm.recordings import replay
from hapticvlm.recordings.recorder import SESSION_LOG
from hapticvlm.recordings.session_log import SessionLogError
from hapticvlm.rendering.heat.limits import AT_REST
from hapticvlm.scenes.reading import read_scene
from hapticvlm.scenes.scan import scan, surfaces_of
from hapticvlm.scenes.scene import SceneError
from hapticvlm.session.actions import DrivePlate, PlayVibration
from hapticvlm.session.hands import Hold
from hapticvlm.session.session import SceneSession
from hapticvlm.session.settings import SessionSettings
from hapticvlm.vision import pictures
from hapticvlm.vision.galleries.storage import GalleryError, read_gallery
from hapticvlm.vision.galleries.user_materials import read_material


@contextlib.contextmanager
def refusing(*errors: type[Exception]) -> Iterator[None]:
    """Accept these errors, in plain words."""
    try:
        yield
    except errors as error:
        require_plain(str(error))


@dataclass(frozen=True)
class Target:
    """One kind of input: `run` takes bytes and a file it may use; `goal` is the long budget."""

    run: Callable[[bytes, Path], None]
    goal: int


class _Sessions:
    """Sessions under one stream of messages: what is refused moves nothing."""

    def __init__(self) -> None:
        self._clock = itertools.count()
        self._session = SceneSession(SessionSettings(owner=True))

    def __call__(self, data: bytes, _: Path) -> None:
        turn = next(self._clock)
        if turn % 500 == 0:
            self._session = SceneSession(SessionSettings(owner=True))
        now = turn * 0.02
        try:
            text = data.decode() if turn % 2 else None
        except UnicodeDecodeError:
            text = None
        is_touch, is_refused, actions = False, False, []
        try:
            partial = decode(data if text is None else text, MATERIALS)
            is_touch = isinstance(partial.message, Touch)
            actions = self._session.receive(partial.message, now, partial.left_out)
        except MessageError as error:
            is_refused = bool(error.text)
            require_plain(error.text)
        moved = [one for one in actions if isinstance(one, PlayVibration | DrivePlate)]
        assert is_touch or not moved or not is_refused
        assert is_refused or actions, "a message without an answer"
        self._session.tick(now + 0.01, AT_REST)


def _pictures(data: bytes, _: Path) -> None:
    kind = "png" if data[:1] == b"\x89" else "jpeg"
    with refusing(pictures.PictureError):
        size = pictures._png_size("$", data) if kind == "png" else pictures._jpeg_size(data)
        frame = Frame(
            id=1,
            captured_at=0.0,
            format="png" if kind == "png" else "jpeg",
            width=size[0],
            height=size[1],
            image=data or b"\0",
            origin="top",
            mask=data if kind == "png" else None,
        )
        crop = pictures.crop(frame, 32)
        assert crop.image.shape == (32, 32, 3)


def _captures(data: bytes, file: Path) -> None:
    file.write_bytes(data)
    with refusing(CaptureError):
        read_lines(file)


def _session_logs(data: bytes, file: Path) -> None:
    file.parent.joinpath(SESSION_LOG).write_bytes(data)
    with refusing(SessionLogError):
        replay.replay(file.parent, MATERIALS)


def _wav(data: bytes, file: Path) -> None:
    file.write_bytes(data)
    with refusing(OSError, ValueError):
        read_wav(file, 10.0)


def _gallery(data: bytes, file: Path) -> None:
    file.write_bytes(data)
    with refusing(GalleryError):
        read_gallery(file)


def _material(data: bytes, file: Path) -> None:
    file.write_bytes(data)
    with refusing(MaterialError):
        read_material(file)


def _config(data: bytes, file: Path) -> None:
    file.write_bytes(data)
    with refusing(ValueError):
        config_file.read(file)


def _serial(data: bytes, _: Path) -> None:
    session = PlateSession()
    session.opened(0.0)
    for number in range(0, len(data), 64):
        now = number * 0.001
        session.receive(data[number : number + 64], now)
        for frame in Deframer().feed(session.outgoing(now)):
            message = plate_protocol.decode(frame)
            assert not isinstance(message, plate_protocol.Setpoint), "nobody asked for heat"
        session.reading(now)


def _scene(data: bytes, file: Path) -> None:
    """A scene that is read is also scanned, and its pictures are read."""
    file.write_bytes(data)
    with refusing(SceneError):
        scene = read_scene(file)
        for node in scene.objects:
            for surface in node.surfaces:
                if surface.texture is not None:
                    with refusing(SceneError):
                        surface.texture.read()
        list(scan(surfaces_of(scene)))


TARGETS = {
    "messages": Target(_Sessions(), 1_000_000),
    "pictures": Target(_pictures, 100_000),
    "captures": Target(_captures, 100_000),
    "session_logs": Target(_session_logs, 100_000),
    "wav": Target(_wav, 100_000),
    "gallery": Target(_gallery, 100_000),
    "material": Target(_material, 100_000),
    "scene": Target(_scene, 100_000),
    "config": Target(_config, 100_000),
    "serial": Target(_serial, 100_000),  # of 100 bytes and more
}


def head() -> Any:
    """Return the first line of a session log."""
    from hapticvlm.recordings import recorded_session as recorded

    line = {"line": 0, "head": recorded.head(SessionSettings(owner=True), Hold())}
    return json.loads(json.dumps(line))

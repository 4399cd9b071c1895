"""A short session, recorded for real: what pages and films of a record are made from."""

import io

import msgspec
from PIL import Image

from hapticvlm import messages
from hapticvlm.recordings import recorded_session as recorded
from hapticvlm.recordings.recorder import Recorder
from hapticvlm.rendering.heat.limits import PlateReading
from hapticvlm.session.hands import Hold
from hapticvlm.session.settings import SessionSettings

BEGAN = 500.0  # s of the session's own clock
READING = PlateReading(31.0, 25.0, 32.0, 0.0, False, 0.0, 0.0, ())
WHITE = (255, 255, 255)


def touch(phase, object_id="mug", hand="right", **fields):
    fields |= {"speed_mps": 0.3, "force_n": 1.0, "captured_at": 0.0}
    return {"type": "touch", "phase": phase, "object_id": object_id, "hand": hand, **fields}


def picture(colour, kind):
    buffer = io.BytesIO()
    Image.new("RGB" if kind == "JPEG" else "L", (64, 64), colour).save(buffer, kind)
    return buffer.getvalue()


def frame():
    mask = Image.new("L", (64, 64))
    mask.paste(255, (16, 16, 48, 48))
    buffer = io.BytesIO()
    mask.save(buffer, "PNG")
    shape = {"format": "jpeg", "width": 64, "height": 64, "origin": "top", "captured_at": 0.0}
    images = {"image": picture(WHITE, "JPEG"), "mask": buffer.getvalue()}
    return {"type": "frame", "object_id": "mug", **shape, **images}


def record(folder):
    """Record 2 s into a folder: a mug is stated, seen, held for a second and let go."""
    stated = [{"object_id": "mug", "name": "TeaMug_01", "temperature_c": 45.0}]
    said = [(0.0, {"type": "scene", "objects": stated, "replace": True}), (0.1, frame())]
    said += [(0.5, touch("contact"))] + [(0.5 + 0.1 * n, touch("slide")) for n in range(1, 11)]
    return record_messages(folder, [*said, (1.55, touch("release"))])


def record_messages(folder, said):
    """Record these messages, each with its time (s), into a folder."""
    recorder = Recorder(folder, frames=True)
    settings = SessionSettings(owner=True, reading=READING)
    hold = Hold()
    write = recorder.begin(recorded.head(settings, hold))
    running = recorded.RecordedSession(settings, hold, write_line=write)
    for number, (at_s, message) in enumerate(said, 1):
        data = msgspec.msgpack.encode({"id": number, **message})
        running.receive(messages.decode(data), BEGAN + at_s)
        running.tick(BEGAN + at_s + 0.05, READING)
    recorder.close()
    (session,) = folder.iterdir()
    return session

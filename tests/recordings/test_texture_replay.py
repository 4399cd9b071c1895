"""A session in which texture maps were read replays bit for bit, with and without their pixels."""

import msgspec
import pytest
from recorded_session import BEGAN, READING, touch

from hapticvlm import messages
from hapticvlm.evidence.ladder import Evidence
from hapticvlm.materials import MATERIALS
from hapticvlm.messages import Frame, ObjectSurface, Scene, SceneObject
from hapticvlm.recordings import recorded_session as recorded
from hapticvlm.recordings.recorder import Recorder
from hapticvlm.recordings.replay import replay
from hapticvlm.session.hands import Hold
from hapticvlm.session.settings import SessionSettings
from hapticvlm.session.targets import RecognitionRequest

PLANKS = "0123456789abcdef0123456789abcdef"
ROOM = SceneObject(
    object_id="room",
    name="mesh205",
    surfaces=[ObjectSurface(name="mat1"), ObjectSurface(name="mat2", texture=PLANKS)],
)
MAP = Frame(
    id=3,
    captured_at=0.0,
    format="rgb8",
    width=8,
    height=8,
    origin="top",
    image=bytes(192),
    purpose="texture",
    object_id="room",
    surface=1,
)


@pytest.mark.parametrize("frames", [False, True])
def test_a_session_with_a_texture_map_replays_bit_for_bit(tmp_path, frames):

    recorder = Recorder(tmp_path, frames=frames)
    settings = SessionSettings(owner=True, reading=READING)
    hold = Hold()
    write = recorder.begin(recorded.head(settings, hold))
    session = recorded.RecordedSession(settings, hold, write_line=write)
    session.receive(Scene(id=1, objects=[ROOM], replace=True), BEGAN)
    contact = touch("contact", object_id="room", surface=1)
    data = msgspec.msgpack.encode({"id": 2, **contact})
    session.receive(messages.decode(data), BEGAN + 0.1)
    session.tick(BEGAN + 0.15, READING)
    requests = session.receive(MAP, BEGAN + 0.2)
    (request,) = [action for action in requests if isinstance(action, RecognitionRequest)]
    evidence = Evidence("texture", (("wood", 0.85),))
    session.recognised(request, evidence, {"texture": 30.0}, BEGAN + 0.25)
    session.tick(BEGAN + 0.3, READING)
    recorder.close()
    (folder,) = tmp_path.iterdir()
    outcome = replay(folder, MATERIALS)
    assert outcome.is_same, outcome.first_difference
    decisions = (folder / "decisions.jsonl").read_text()
    assert '"texture"' in decisions
    assert decisions.count("\n") >= 2

"""A scene that was taken in part is recorded as it was used, and replays the same."""

import json

import msgpack

from hapticvlm.materials import MATERIALS
from hapticvlm.partial_messages import decode
from hapticvlm.recordings import recorded_session as recorded
from hapticvlm.recordings.lines import Key
from hapticvlm.recordings.log_player import LogPlayer
from hapticvlm.session.hands import Hold
from hapticvlm.session.settings import SessionSettings

SCENE = {
    "type": "scene",
    "id": 1,
    "replace": True,
    "objects": [
        {"object_id": "vase", "name": "Glass_Vase", "material": "porcelain", "colour": "red"},
        {"object_id": "kettle", "material": "metal", "temperature_c": 60.0},
    ],
}
TOUCH = {"type": "touch", "phase": "contact", "hand": "right", "force_n": 300.0, "speed_mps": 0.3}


def test_a_record_names_what_was_left_out_and_replays_bit_for_bit(tmp_path):
    lines = []
    settings, hold = SessionSettings(owner=True), Hold()
    session = recorded.RecordedSession(
        settings, hold, write_line=lambda line, _: lines.append(json.loads(json.dumps(line)))
    )
    head = json.loads(json.dumps(recorded.head(settings, hold)))
    touches = [
        {**TOUCH, "id": 2 + number, "captured_at": 0.1 * number, "object_id": object_id}
        for number, object_id in enumerate(("vase", "vase", "kettle"))
    ]
    for number, value in enumerate((SCENE, *touches)):
        partial = decode(msgpack.packb(value), MATERIALS)
        session.receive(partial.message, 10.0 + 0.1 * number, partial.left_out)
    inputs = [line for line in lines if Key.MESSAGE in line]
    assert [part["path"] for part in inputs[0][Key.LEFT_OUT]] == [
        "objects[0].colour",
        "objects[0].material",
    ]
    assert inputs[1][Key.LEFT_OUT][0]["path"] == "force_n"
    player = LogPlayer(tmp_path, head, MATERIALS, None)
    for number, line in enumerate(lines, 1):
        player.play({Key.LINE: number, **line})
    assert player.outcome.is_same
    assert player.outcome.outputs > 3

"""The session log is a file format: its names stay when code is renamed."""

from typing import Any

from hapticvlm.messages import Scene, SceneObject, Stop, Touch
from hapticvlm.recordings.recorded_session import RecordedSession
from hapticvlm.rendering.heat.limits import AT_REST
from hapticvlm.session.settings import SessionSettings


def test_the_names_in_a_session_log_are_those_of_older_logs():
    lines = []
    given: dict[str, Any] = {"captured_at": 1.0, "hand": "right", "speed_mps": 0.3, "force_n": 1.0}
    session = RecordedSession(
        SessionSettings(owner=True), None, write_line=lambda line, _: lines.append(line)
    )
    table = SceneObject(object_id="table", material="wood")
    session.receive(Scene(id=1, objects=[table], replace=True), 0.0)
    session.receive(Touch(id=2, phase="contact", object_id="table", **given), 1.0)
    session.tick(1.02, AT_REST)
    session.receive(Touch(id=3, phase="release", object_id="table", **given), 1.1)
    session.tick(60.0, AT_REST)
    session.receive(Stop(id=4, scope="all"), 61.0)
    outputs = [output for line in lines for output in line.get("out", [])]
    names = [output["do"] for output in outputs]
    assert names == ["Feel", "say", "Heat", "LetGo", "RestPlate", "HoldAtRest"]
    assert outputs[0]["command"]["stroke"] == {"speed_mps": 0.3, "force_n": 1.0}
    assert [line["in"] for line in lines if "in" in line][:3] == ["message", "message", "tick"]

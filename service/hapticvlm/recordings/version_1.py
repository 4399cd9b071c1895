"""Translates a line of a version 1 session log to version 2.

Version 1 is the file `tape.jsonl`, whose head has no `version`. It names some kinds of lines by
older words, and it leaves out fields that have their usual value, because they were added to the
format later. The translation gives every line the names and fields of `lines.py`, so a replay
compares both versions with the same code and the same exactness. Knows no file.
"""

from __future__ import annotations

from collections.abc import Mapping

from hapticvlm.recordings.lines import VERSION, Input, Key, Line, Output

SESSION_LOG = "tape.jsonl"

_INPUTS = {"look": Input.RECOGNITION, "sight": Input.SCENE_VIEW, "held": Input.STOP}
_OUTPUTS = {
    "say": Output.DECISION,
    "Feel": Output.VIBRATION,
    "LetGo": Output.RELEASE,
    "SetGain": Output.GAIN,
    "Heat": Output.SETPOINT,
    "RestPlate": Output.REST_PLATE,
    "HoldAtRest": Output.HOLD,
}
_KEYS = {"sight": Key.SCENE_VIEW}
_HEAD_KEYS = {"saved": Key.SAVED_MATERIALS}
# Fields that the first logs lack, and the value the service then had.
_HEAD_DEFAULTS: Line = {
    Key.PLATE_RESISTANCE: 0.0,
    Key.THERMAL_GAIN: 1.0,
    Key.SAVED_MATERIALS: {},
    Key.HOLD: [],
}
_COMMAND_KEYS = {"stroke": "motion"}
_COMMAND_DEFAULTS: Line = {"gain": 1.0, "thickness_m": None, "hum": None}


def translate(line: Line) -> Line:
    """Return the same line in version 2.

    A line that is not one of a session log at all raises AttributeError, KeyError or TypeError.
    """
    renamed = _renamed(line, _KEYS)
    if Key.HEAD in renamed:
        head = _HEAD_DEFAULTS | _renamed(renamed[Key.HEAD], _HEAD_KEYS)
        renamed[Key.HEAD] = {Key.VERSION: VERSION, **head}
    if Key.IN in renamed:
        renamed[Key.IN] = _INPUTS.get(renamed[Key.IN], renamed[Key.IN])
    if Key.OUT in renamed:
        renamed[Key.OUT] = [_output(output) for output in renamed[Key.OUT]]
    return renamed


def _output(output: Line) -> Line:
    translated = {**output, Key.DO: _OUTPUTS.get(output[Key.DO], output[Key.DO])}
    if translated[Key.DO] == Output.VIBRATION:
        command = _renamed(translated[Key.COMMAND], _COMMAND_KEYS)
        translated[Key.COMMAND] = _COMMAND_DEFAULTS | command
    return translated


def _renamed(fields: Line, names: Mapping[str, str]) -> Line:
    return {names.get(name, name): value for name, value in fields.items()}

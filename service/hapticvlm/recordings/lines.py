"""The names in the lines of a session log: a file format, which stays when code is renamed.

The log is written and read in this room alone, and every key of it stands here once. Some names are
older than the words of today's code ("look" is a recognition, "sight" a scene view, "say" a
decision, "Feel" a vibration command): files of years ago must go on to be read.
"""

from __future__ import annotations

from enum import StrEnum
from typing import Any

Line = dict[str, Any]


class Key(StrEnum):
    """A field of a line."""

    LINE = "line"  # its number; a gap means that lines were lost
    HEAD = "head"  # what the session began with
    NOW = "now"  # s, the service's clock
    IN = "in"  # what came into the session: an Input
    OUT = "out"  # what the outputs were to do then: each an Output by its DO
    DO = "do"
    MESSAGE = "message"
    FILE = "file"  # of a picture that was kept
    MASK_FILE = "mask_file"
    NUMBER = "number"  # of the recognition or question that this answers
    STAGES_MS = "stages_ms"
    EVIDENCE = "evidence"
    SIGHT = "sight"
    EMBEDDING = "embedding"
    BRIGHTNESS = "brightness"
    KIND = "kind"
    ANSWER = "answer"
    READING = "reading"
    OWNER = "owner"
    THERMAL_GAIN = "thermal_gain"
    SCOPE = "scope"
    COMMAND = "command"
    VERSION = "hapticvlm"
    CAN_ASK = "can_ask"
    CONTACT_RESISTANCE = "contact_resistance"
    PLATE_RESISTANCE = "plate_resistance"
    MATERIALS = "materials"
    SAVED = "saved"
    HOLD = "hold"  # what a stop keeps at rest: output, hand, whether a release has armed it


class Input(StrEnum):
    """What came into a session."""

    MESSAGE = "message"
    RECOGNITION = "look"
    SCENE_VIEW = "sight"
    ANSWER = "answer"
    TICK = "tick"
    OWNER = "owner"
    REST = "rest"
    HELD = "held"
    HOLD = "hold"  # another session stopped or released: the hold is shared by all of them


class Output(StrEnum):
    """What a session had the outputs do, or announced."""

    DECISION = "say"
    VIBRATION = "Feel"
    RELEASE = "LetGo"
    GAIN = "SetGain"
    SETPOINT = "Heat"
    REST_PLATE = "RestPlate"
    HOLD = "HoldAtRest"

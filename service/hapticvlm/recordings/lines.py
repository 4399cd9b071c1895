"""Defines the names in a session log: every key and every kind of line, in format version 2.

Only this package writes and reads the log. The names are a file format: when code is renamed they
stay, or VERSION grows. Knows no file.
"""

from __future__ import annotations

from enum import StrEnum
from typing import Any

VERSION = 2

Line = dict[str, Any]


class Key(StrEnum):
    """A field of a line."""

    LINE = "line"  # the line's number; a gap means that lines were lost
    HEAD = "head"  # the settings a session begins with
    VERSION = "version"  # of the format
    RELEASE = "hapticvlm"  # the version of the program that recorded
    NOW = "now"  # s, the service's clock
    IN = "in"  # the kind of an input to the session: an Input
    OUT = "out"  # the outputs that followed from it, each an Output by its DO
    DO = "do"
    MESSAGE = "message"
    LEFT_OUT = "left_out"  # parts of the message that were left out or changed before its use
    FILE = "file"  # of a picture that was kept
    MASK_FILE = "mask_file"
    NUMBER = "number"  # of the recognition or question that this answers
    STAGES_MS = "stages_ms"
    EVIDENCE = "evidence"
    SCENE_VIEW = "scene_view"
    EMBEDDING = "embedding"
    BRIGHTNESS = "brightness"
    KIND = "kind"
    ANSWER = "answer"
    READING = "reading"
    OWNER = "owner"
    THERMAL_GAIN = "thermal_gain"
    SCOPE = "scope"
    COMMAND = "command"
    CAN_ASK = "can_ask"
    CONTACT_RESISTANCE = "contact_resistance"
    PLATE_RESISTANCE = "plate_resistance"
    FEEL = "feel"  # what an uncertain material is rendered as; logs without it: graded
    MATERIALS = "materials"
    SAVED_MATERIALS = "saved_materials"
    HOLD = "hold"  # outputs kept at rest by a stop: output, hand, whether a release has armed it


class Input(StrEnum):
    """The kind of an input to a session."""

    MESSAGE = "message"
    RECOGNITION = "recognition"
    SCENE_VIEW = "scene_view"
    ANSWER = "answer"
    TICK = "tick"
    OWNER = "owner"
    REST = "rest"
    STOP = "stop"
    HOLD = "hold"  # another session stopped or released: the hold is shared by all of them


class Output(StrEnum):
    """The kind of an output: an action of the session, or a decision that it announced."""

    DECISION = "decision"
    VIBRATION = "play_vibration"
    RELEASE = "release_hand"
    GAIN = "set_gain"
    SETPOINT = "drive_plate"
    REST_PLATE = "rest_plate"
    HOLD = "hold_outputs"

"""Names of everything that the gateway counts: drops, refusals, closes, answers and owners.

A value is the name that `/status`, `/metrics` and the dashboard show. Code compares members and
never reads a name, so a reworded one changes no behaviour.
"""

from __future__ import annotations

from enum import StrEnum

from hapticvlm.messages import ErrorCode


class Count(StrEnum):
    """One thing that is counted."""

    # Frames that were not recognised. Telemetry reports their sum as `dropped_frames`.
    FRAMES_SUPERSEDED = "frames superseded"
    FRAMES_STALE = "frames stale"
    FRAMES_RATE = "frames rate"
    # Results.
    RECOGNITIONS = "recognitions"
    LATE_ANSWERS = "late answers dropped"
    LATE_VLM_ANSWERS = "late vlm answers dropped"
    LATE_CONTACTS = "contacts too late to strike"
    EVENTS_NOT_SENT = "events not sent"
    # Messages answered by `error`, by its code.
    REFUSED_PROTOCOL = "refused: protocol"
    REFUSED_MESSAGE = "refused: message"
    REFUSED_LIMIT = "refused: limit"
    REFUSED_OVERLOAD = "refused: overload"
    REFUSED_UNSAFE = "refused: unsafe"
    REFUSED_DEVICE = "refused: device"
    REFUSED_MODEL = "refused: model"
    REFUSED_NOT_OWNER = "refused: not_owner"
    # Clients that were not admitted.
    REFUSED_TOKEN = "refused: token"
    REFUSED_ORIGIN = "refused: origin"
    REFUSED_SERVER_FULL = "refused: no place"
    REFUSED_CONNECTS = "refused: too many connects"
    # Connections that were closed, by the limit exceeded.
    CLOSED_BYTES = "closed: too many bytes"
    CLOSED_MESSAGES = "closed: too many messages"
    CLOSED_CONTROL_FRAMES = "closed: too many control frames"
    CLOSED_REFUSED_MESSAGES = "closed: too many refused messages"
    CLOSED_BEFORE_HELLO = "closed: too much before hello"
    CLOSED_WAITING_SOCKETS = "closed: too many sockets before hello"
    CLOSED_HELD_BYTES = "closed: too much unfinished"
    CLOSED_MESSAGE_SIZE = "closed: message too big"
    CLOSED_MADE_ROOM = "closed: made room"
    # Owners of the outputs.
    OWNERS_ENDED = "owners ended"
    OWNERS_REPLACED = "owners replaced"

    @property
    def reason(self) -> str:
        """The part behind the colon: the reason that a closed client is told."""
        return self.value.partition(": ")[2]


DROPPED_FRAMES = frozenset({Count.FRAMES_SUPERSEDED, Count.FRAMES_STALE, Count.FRAMES_RATE})


def refused(code: ErrorCode) -> Count:
    """Return the count of messages that are answered by `error` with this code."""
    return Count(f"refused: {code}")

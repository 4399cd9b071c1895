"""What each role may send: an observer describes no scene, and only the owner moves outputs."""

from __future__ import annotations

from hapticvlm.messages import Frame, MessageError, Scene, Set, Touch


def check_describes(message: Frame | Scene, *, observer: bool) -> None:
    """Refuse a frame or a scene of an observer. Raises MessageError."""
    if not observer:
        return
    what = "send no frames" if isinstance(message, Frame) else "describe no scene"
    text = f"observers {what}; connect with role scene"
    raise MessageError("protocol", text, path="$.type", id=message.id)


def check_touch(touch: Touch, *, owner: bool) -> None:
    """Refuse a touch of another than the owner, and one of nothing. Raises MessageError."""
    if not owner:
        text = "another scene owns the outputs; this connection may watch and recognise only"
        raise MessageError("not_owner", text, path="$.type", id=touch.id)
    needs_target = touch.phase != "release" and touch.interaction != "swing"
    if needs_target and touch.object_id is None and touch.region is None:
        text = "$: a touch needs `object_id` or `region`; add one"
        raise MessageError("message", text, path="$.object_id", id=touch.id)


def check_set(wanted: Set, *, owner: bool, observer: bool) -> None:
    """Refuse settings that are not this connection's. Raises MessageError."""
    if wanted.watch is not None and not observer:
        text = "$.watch: only observers watch; connect with role observer"
        raise MessageError("protocol", text, path="$.watch", id=wanted.id)
    if wanted.ambient_c is not None and observer:
        text = "$.ambient_c: observers have no scene; connect with role scene"
        raise MessageError("protocol", text, path="$.ambient_c", id=wanted.id)
    if not owner and (wanted.vibration_gain, wanted.thermal_gain) != (None, None):
        text = "another scene owns the outputs; only their owner sets gains"
        raise MessageError("not_owner", text, path="$", id=wanted.id)

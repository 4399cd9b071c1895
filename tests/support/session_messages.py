"""Messages to a session, and the session that owns the outputs; no socket is involved."""

from collections.abc import Iterable
from typing import TypeVar

import numpy as np
import simplejpeg

from hapticvlm.messages import Frame, Scene, SceneObject, Touch
from hapticvlm.perception import NEUTRAL_C
from hapticvlm.rendering.heat.limits import PlateReading
from hapticvlm.session.actions import Action, Reply
from hapticvlm.session.session import SceneSession
from hapticvlm.session.settings import SessionSettings

READING = PlateReading(
    plate_c=NEUTRAL_C,
    sink_c=23.0,
    setpoint_c=NEUTRAL_C,
)
T = TypeVar("T")
PIXEL = simplejpeg.encode_jpeg(np.full((32, 32, 3), 90, np.uint8))


def touch(phase="contact", object_id="table", at=0.0, **fields):
    given = {"id": 7, "hand": "right", "speed_mps": 0.3, "force_n": 1.0, "captured_at": at}
    return Touch(phase=phase, object_id=object_id, **{**given, **fields})


def frame(id=5, object_id="thing", at=0.0, **fields):
    given = {"format": "jpeg", "width": 32, "height": 32, "origin": "top", "image": PIXEL}
    return Frame(id=id, captured_at=at, object_id=object_id, **{**given, **fields})


def scene(*objects, replace=True, **fields):
    return Scene(id=2, objects=list(objects), replace=replace, **fields)


def owner(*objects, **fields):
    session = SceneSession(SessionSettings(owner=True))
    session.receive(scene(*objects, **fields), 0.0)
    return session


def only(actions: Iterable[Action], kind: type[T]) -> list[T]:
    return [action for action in actions if isinstance(action, kind)]


def replies(actions: Iterable[Action], kind: type[T]) -> list[T]:
    return [a.message for a in only(actions, Reply) if isinstance(a.message, kind)]


TABLE = SceneObject(object_id="table", material="wood")

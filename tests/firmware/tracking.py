"""Measures how well the compiled firmware follows a touch, and the effect of pre-conditioning."""

from __future__ import annotations

from dataclasses import dataclass

from . import scenes
from .build import Chip
from .scenes import Rig

MATERIALS = ("wood", "glass", "fabric", "metal")
AMBIENTS_C = (15.0, 23.0, 30.0)
APPROACH_S, CONTACT_S, SETTLE_S = 1.0, 10.0, 1.0
REST_S, FREE_S = 5.0, 0.5


@dataclass(frozen=True)
class Tracking:
    """One touch of `contact_s`; errors in degC of the true plate, limits that shaped the course."""

    material: str
    ambient_c: float
    approached: bool
    limited_rms_c: float  # against the setpoint that was sent, from 1 s after contact
    first_rms_c: float  # against the target from physics, in the first second
    first_skin_rms_c: float  # modelled skin against the target from physics, in the first second
    limited_by: tuple[str, ...]
    unnamed: int  # moments with a changed setpoint but without a reported limit


def touch(
    chip: Chip,
    material: str,
    ambient_c: float,
    *,
    approached: bool = True,
    contact_s: float = CONTACT_S,
) -> Tracking:
    """Let a palm rest on a neutral plate, then approach and touch, or touch without approach."""
    board = chip.board(ambient_c)
    rig = Rig(board)
    try:
        rig.live(3.0)
        contact = scenes.contact(material, ambient_c)
        limits: set[str] = set()
        if approached:
            rig.course = rig.course.approach(contact, board.now)
            limits |= {m.limited_by for m in rig.live(APPROACH_S) if m.limited_by}
        rig.course = rig.course.touch(contact, material, board.now)
        begun_at = board.now
        moments = rig.live(contact_s)
    finally:
        rig.close()
        board.close()
    first = [moment for moment in moments if moment.now - begun_at <= SETTLE_S]
    later = [moment for moment in moments if moment.now - begun_at > SETTLE_S] or first
    limits |= {moment.limited_by for moment in moments if moment.limited_by}
    return Tracking(
        material,
        ambient_c,
        approached,
        scenes.rms(later, lambda moment: moment.plate_c - moment.setpoint_c),
        scenes.rms(first, lambda moment: moment.plate_c - moment.wanted_c),
        scenes.rms(first, lambda moment: moment.skin_c - moment.wanted_c),
        tuple(sorted(limits)),
        sum(moment.setpoint_c != moment.wanted_c and not moment.limited_by for moment in moments),
    )

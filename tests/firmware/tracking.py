"""Measures how well the compiled firmware follows a touch, and the effect of pre-conditioning."""

from __future__ import annotations

import math
from dataclasses import dataclass

from hapticvlm.perception import NEUTRAL_C
from hapticvlm.rendering.heat.trajectory import ThermalTrajectory
from hapticvlm.session.hands import LONGEST_LEAD_S

from . import scenes
from .build import Chip
from .scenes import Moment, Rig

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
    unlimited_rms_c: float  # against the target from physics, from 1 s after contact
    first_rms_c: float  # against the target from physics, in the first second
    first_skin_rms_c: float  # modelled skin against the target from physics, in the first second
    limited_by: tuple[str, ...]
    unnamed: int  # moments with a changed setpoint but without a reported limit


@dataclass(frozen=True)
class Felt:
    """The touch as felt by a palm of one plate resistance; errors of the skin in degC."""

    material: str
    ambient_c: float
    palm_resistance: float
    at_1s_c: float
    limited_share: float  # of the time from the lead's begin to 1 s after contact
    free_rms_c: float | None  # from 1 s on, where no limit has acted for FREE_S; None: nowhere
    strict_rms_c: float | None  # over moments without a limit


def felt(chip: Chip, material: str, ambient_c: float, palm_resistance: float) -> Felt:
    """Touch with a palm of known resistance, after a lead as short as an older client's.

    The skin is measured from its resting temperature: body heat keeps it above a neutral plate.
    """
    board = chip.board(ambient_c)
    board.plant.touch(palm_resistance)
    rig = Rig(board)
    try:
        rig.course = ThermalTrajectory(plate_resistance=palm_resistance)
        above_c = rig.live(REST_S)[-1].skin_c - NEUTRAL_C
        contact = scenes.contact(material, ambient_c)
        rig.course = rig.course.approach(contact, board.now)
        led = rig.live(LONGEST_LEAD_S)
        rig.course = rig.course.touch(contact, material, board.now)
        begun_at = board.now
        moments = rig.live(CONTACT_S)
    finally:
        rig.close()
        board.close()
    off = [moment.skin_c - above_c - moment.physics_c for moment in moments]
    first = sum(moment.now - begun_at <= SETTLE_S for moment in moments)
    limited = [moment.is_limited for moment in (*led, *moments[:first])]
    return Felt(
        material,
        ambient_c,
        palm_resistance,
        off[first - 1],
        sum(limited) / len(limited),
        _free_rms(moments, off, first, FREE_S),
        _free_rms(moments, off, first, 0.0),
    )


def _free_rms(moments: list[Moment], off: list[float], first: int, since_s: float) -> float | None:
    """Return the RMS from `first` on over moments without a recent limit, degC."""
    last_limited, kept = -math.inf, []
    for at, moment in enumerate(moments):
        if moment.is_limited:
            last_limited = moment.now
        elif at >= first and moment.now - last_limited > since_s:
            kept.append(off[at] ** 2)
    return math.sqrt(sum(kept) / len(kept)) if kept else None


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
        scenes.rms(later, lambda moment: moment.plate_c - moment.wanted_c),
        scenes.rms(first, lambda moment: moment.plate_c - moment.wanted_c),
        scenes.rms(first, lambda moment: moment.skin_c - moment.wanted_c),
        tuple(sorted(limits)),
        sum(moment.setpoint_c != moment.wanted_c and not moment.limited_by for moment in moments),
    )

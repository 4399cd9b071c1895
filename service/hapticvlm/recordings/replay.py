"""Replays a recorded session without devices, and compares its outputs with the recorded ones."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import msgspec
import numpy as np
from numpy.typing import NDArray

from hapticvlm import documents
from hapticvlm.materials import Material
from hapticvlm.messages import MessageError
from hapticvlm.recordings.lines import Key
from hapticvlm.recordings.log_player import LogPlayer, Recognise, Replayed
from hapticvlm.recordings.recorder import SESSION_LOG
from hapticvlm.recordings.session_log import (
    DAMAGED,
    SessionLogError,
    not_a_line,
    read_session_log,
)
from hapticvlm.rendering.vibration.vibration import RATE_HZ
from hapticvlm.rendering.vibration.voices import Command, Voices
from hapticvlm.session.actions import ReleaseHand, SetGain

BLOCK = 128
LONGEST_S = 3600.0  # of vibration: more would fill the memory


def replay(
    folder: Path, table: Mapping[str, Material], recognise: Recognise | None = None
) -> Replayed:
    """Replay a session with these materials; `recognise` recognises its pictures again.

    Raises SessionLogError.
    """
    path = folder / SESSION_LOG
    lines = read_session_log(folder)
    head = next(lines, {}).get(Key.HEAD)
    if not isinstance(head, dict):
        raise SessionLogError(
            f"{path}:1: the head is missing; give a folder that `hapticvlm serve --record` wrote, "
            "with all parts of its file in one"
        )
    try:
        materials = msgspec.convert(head[Key.MATERIALS], list[str])
        missing = [name for name in materials if name not in table]
        player = None if missing else LogPlayer(folder, head, table, recognise)
    except DAMAGED as error:
        reason = documents.reason(error)
        raise SessionLogError(f"{path}:1: not the head of a session log ({reason})") from None
    if player is None:
        raise SessionLogError(
            f"{folder}: recorded with materials that are not known here ({', '.join(missing)}); "
            "give the gallery that has them: --gallery GALLERY"
        )
    for line in lines:
        try:
            player.play(line)
        except (*DAMAGED, MessageError) as error:
            raise not_a_line(f"{path}:{line.get(Key.LINE, '?')}", error) from None
    counts = player.outcome.counts
    if counts["picture not kept"] and not counts["recognised again"]:
        raise SessionLogError(
            f"{folder}: has no pictures to recognise; record with --record-frames"
        )
    return player.outcome


def waveform(
    outcome: Replayed, voices: Voices, started: float | None = None
) -> NDArray[np.float32]:
    """Render the vibration of a replay with new voices, (N,) float32 at RATE_HZ.

    It begins at `started` on the log's clock, else with the first sound. The same log and voices
    give the same bits. Raises SessionLogError for more than LONGEST_S.
    """
    if not outcome.sounds:
        return np.zeros(0, np.float32)
    started = outcome.sounds[0][0] if started is None else started
    blocks: list[NDArray[np.float32]] = []
    waiting = list(reversed(outcome.sounds))
    ends = outcome.sounds[-1][0] + 1.0
    if ends - started > LONGEST_S:
        raise SessionLogError(
            f"the session lasts {(ends - started) / 3600:.1f} h; the limit is "
            f"{LONGEST_S / 3600:.0f} h of vibration: record shorter sessions"
        )
    while (now := started + len(blocks) * BLOCK / RATE_HZ) < ends:
        while waiting and waiting[-1][0] <= now:
            _sound(voices, waiting.pop()[1])
        blocks.append(voices.render(BLOCK, now))
    return np.concatenate([np.zeros(0, np.float32), *blocks])


def _sound(voices: Voices, action: Command | ReleaseHand | SetGain) -> None:
    match action:
        case Command():
            voices.apply(action)
        case ReleaseHand():
            voices.release(action.hand)
        case SetGain():
            voices.gain = action.gain

"""Plays patterns through a running service, as the scene that owns its outputs. Knows no study.

The hand moves as `design/stimuli` states; each touch is renewed while it lasts, since the service
ends a touch whose renewal does not come. Between patterns the hand rests on metal at the neutral
temperature: the plate is driven back to neutral and the modelled skin with it, sooner than if the
hand let go.

A pattern counts as presented only if the devices did what it asks for. Faults, a limit that
withholds heat, and a speaker at level zero raise PresentationError. Telemetry is the evidence, so
`listen` must run beside everything else, and `play` waits for the report that covers its end.
"""

from __future__ import annotations

import asyncio
import contextlib
import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any

from hapticvlm.client import Client, Refused
from hapticvlm.devices.faults import SPEAKER_GONE, SPEAKER_LOW, SPEAKER_UNREACHED, describe
from hapticvlm.perception import NEUTRAL_C
from hapticvlm.rendering.vibration.vibration import Motion
from hapticvlm_studio.design.stimuli import Part, Stimulus, StudyError, motion, parts

TOUCH_S = 0.06  # between renewals; a lease of 0.25 s survives three lost ones
STROKE_S = 0.02  # between renewals in a stroke, so a whoosh rises and falls in 20 steps
AMBIENT_C = 22.0
INVALIDATING_LIMITS = ("dose", "sink")  # those that withhold the heat or cold of a pattern
TELEMETRY_S = 2.0
SILENCE_S = 3.0  # within which the service tells that a speaker does not play where it should
# Written into the participants' files as the reason of a spoiled trial and counted by the report,
# so the words are part of the file format.
SILENT = "the speaker played nothing: see to it and to its level, then go on"
_STILL = Motion(0.0, 0.0)
NEUTRAL = Stimulus("neutral", "", "", "metal", "slide", NEUTRAL_C, speed_mps=0.0, force_n=0.0)


def is_silence(why: str) -> bool:
    """Return whether a trial was spoiled for this reason because its speaker was not felt."""
    faults = (SPEAKER_GONE, SPEAKER_LOW, SPEAKER_UNREACHED)
    return why == SILENT or any(fault.text in why for fault in faults)


class PresentationError(Exception):
    """Raised when the devices cannot present a pattern; the message is for the experimenter."""


@dataclass(frozen=True, slots=True)
class Played:
    """The report of the service on one pattern.

    Temperatures are in degC: `onset_plate_c` when the first stroke began, `plate_c` and
    `setpoint_c` when the last one ended. `limited_by` is the last limit that acted, `speaker_level`
    the highest level (None: no telemetry arrived), `underruns` the audio blocks that were missed.
    """

    onset_plate_c: float | None
    plate_c: float | None
    setpoint_c: float | None
    limited_by: str | None
    speaker_level: float | None
    underruns: int


class Player:
    """A scene whose objects are the patterns; `listen` must run beside everything else."""

    def __init__(self, client: Client, settle_c: float) -> None:
        self._client = client
        self._settle_c = settle_c
        self._telemetry: dict[str, Any] = {}
        self._received_at = float("-inf")
        self._limited_by: str | None = None
        self._level: float | None = None
        self._faults: set[str] = set()  # since the pattern began
        self._telemetry_arrived = asyncio.Event()

    @property
    def devices(self) -> dict[str, Any]:
        """The names of the devices, and whether they are simulated."""
        devices: dict[str, Any] = self._client.welcome["devices"]
        return devices

    @property
    def outputs(self) -> dict[str, Any]:
        """The latest report of plate and speaker; empty before the first one."""
        shown = ("plate_c", "setpoint_c", "speaker_level", "faults", "underruns")
        return {name: self._telemetry[name] for name in shown if name in self._telemetry}

    async def prepare(self, stimuli: Sequence[Stimulus]) -> None:
        """Declare one object per pattern. Raises StudyError when another scene owns the outputs."""
        if not self._client.welcome["owner"]:
            raise StudyError("another scene owns the outputs; close it and start again")
        objects = [
            {"object_id": s.name, "material": s.material, "temperature_c": s.object_c}
            for s in (*stimuli, NEUTRAL)
        ]
        await self._client.scene(objects, ambient_c=AMBIENT_C)

    async def listen(self) -> None:
        """Receive the service's reports of its outputs until cancelled."""
        while True:
            event = await self._client.events.get()
            if event["type"] == "telemetry":
                self._telemetry = event
                self._received_at = time.monotonic()
                self._telemetry_arrived.set()
                self._level = max(self._level or 0.0, event["speaker_level"])
                self._faults.update(event["faults"])
            elif event["type"] == "decision" and event.get("limited_by"):
                self._limited_by = event["limited_by"]

    async def settle(self, rest_s: float, longest_s: float) -> None:
        """Rest at least `rest_s`, and until the plate is near neutral.

        Raises PresentationError when it is not within `longest_s` more, and within SILENCE_S for a
        fault of the devices: a person has to see to that.
        """
        begun = time.monotonic()
        await self.release()
        try:
            await self._touch("approach", NEUTRAL)
            while (reason := self._unrest()) or time.monotonic() < begun + rest_s:
                patience_s = SILENCE_S if self._telemetry.get("faults") else longest_s
                if reason and time.monotonic() > begun + rest_s + patience_s:
                    raise PresentationError(reason)
                await self._touch("slide", NEUTRAL)
                await asyncio.sleep(TOUCH_S)
        except (Refused, ConnectionError) as error:
            raise PresentationError(_cause(error)) from None

    def _unrest(self) -> str | None:
        """Return why no pattern can be presented now, or None."""
        if time.monotonic() - self._received_at > TELEMETRY_S:
            return "the service sends no telemetry"
        if self._telemetry["faults"]:
            return _in_words(self._telemetry["faults"])
        plate_c = self._telemetry["plate_c"]
        if plate_c is None:
            return "the plate reports no temperature"
        if abs(plate_c - NEUTRAL_C) > self._settle_c:
            return f"the plate is at {plate_c:.1f} degC, waiting for {NEUTRAL_C:g} degC"
        return None

    async def play(self, stimulus: Stimulus, begun: Callable[[], None]) -> Played:
        """Play one pattern to its end; call `begun` once the service has taken its first stroke.

        Raises PresentationError when the devices could not present it as intended.
        """
        self._limited_by = self._level = None
        self._faults.clear()
        underruns = self._telemetry.get("underruns", 0)
        await self.release()
        try:
            onset_plate_c = await self._stroke(stimulus, begun)
            self._check()
            plate_c, setpoint_c = (self._telemetry.get(k) for k in ("plate_c", "setpoint_c"))
            await self.release()
            if not self.devices["speaker"]["simulated"]:
                await asyncio.sleep(SILENCE_S)  # until a silence of the last stroke is told, too
            await self._wait_for_telemetry()
            self._check_faults()
        except (Refused, ConnectionError) as error:
            raise PresentationError(_cause(error)) from None
        finally:
            await self.release()
        if self._level == 0.0:
            raise PresentationError(SILENT)
        return Played(
            onset_plate_c,
            plate_c,
            setpoint_c,
            self._limited_by,
            self._level,
            self._telemetry.get("underruns", 0) - underruns,
        )

    async def _stroke(self, stimulus: Stimulus, begun: Callable[[], None]) -> float | None:
        """Move the hand; return the plate's temperature when the first stroke began, degC."""
        onset_plate_c = None
        has_begun = False
        for part in parts(stimulus):
            if part.phase == "contact" and not has_begun:
                self._check()
                onset_plate_c = self._telemetry.get("plate_c")
                await self._touch("contact", stimulus, motion(stimulus, part, 0.0))
                begun()
                has_begun = True
            await self._hold(part, stimulus)
        return onset_plate_c

    async def _wait_for_telemetry(self) -> None:
        """Wait for the telemetry that covers the end of a stroke."""
        # The next report may have been measured before the stroke ended and be on its way already;
        # the one after it was not.
        for _ in range(2):
            self._telemetry_arrived.clear()
            with contextlib.suppress(TimeoutError):
                async with asyncio.timeout(TELEMETRY_S):
                    await self._telemetry_arrived.wait()

    def _check(self) -> None:
        """Raise PresentationError when the devices cannot present the pattern as intended."""
        if self._limited_by in INVALIDATING_LIMITS:
            reason = (
                "the thermal dose of this session is used up"
                if self._limited_by == "dose"
                else "the plate's sink is too hot"
            )
            raise PresentationError(f"{reason}: let the person and the plate rest, then continue")
        self._check_faults()

    def _check_faults(self) -> None:
        """Raise PresentationError when a fault came since the pattern began, though it be gone."""
        if faults := self._faults.union(self._telemetry.get("faults", ())):
            raise PresentationError(_in_words(faults))

    async def stop(self) -> None:
        """Bring all outputs to rest at once and hold them there."""
        await self._client.stop()

    async def release(self) -> None:
        """Release the hand. After `stop`, this lets the next pattern play."""
        try:
            await self._client.send("touch", **_TOUCH, phase="release", captured_at=_now())
        except ConnectionError:
            return  # without a connection the service has brought the outputs to rest already

    async def _hold(self, part: Part, stimulus: Stimulus) -> None:
        begun_at = time.monotonic()
        every_s = TOUCH_S if part.is_still else STROKE_S
        while (elapsed_s := time.monotonic() - begun_at) < part.seconds:
            self._check_faults()
            await self._touch(part.phase, stimulus, motion(stimulus, part, elapsed_s))
            await asyncio.sleep(min(every_s, part.seconds - elapsed_s))

    async def _touch(self, phase: str, stimulus: Stimulus, moves: Motion = _STILL) -> None:
        await self._client.touch(
            phase,
            stimulus.name,
            interaction="slide" if phase == "slide" else stimulus.interaction,
            speed_mps=moves.speed_mps,
            force_n=moves.force_n,
        )


def _in_words(faults: Iterable[str]) -> str:
    return "; ".join(map(describe, sorted(faults)))


def _cause(error: Exception) -> str:
    remedy = "" if isinstance(error, Refused) else "; start again, what is on disk stays"
    return f"{error}{remedy}"


_TOUCH = {"hand": "right", "speed_mps": 0.0, "force_n": 0.0}
_now = time.monotonic

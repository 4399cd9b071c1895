"""Estimates the ambient temperature of one scene and decides when to ask a VLM for it.

A whole frame is recognised twice a second. A view never asked about that lasts for SETTLE_S is
worth a question, at most one in ASK_EVERY_S, and a longer pause after each question that failed.
Views asked about are remembered, so that a light that flickers is asked about twice and no more.
Readings whose intervals overlap are of one climate and are averaged; one that contradicts, of
another place and not of another light, begins a new climate. The default gives way at once; from
one reading to the next what is rendered follows slowly and in steps. Knows no model and no clock.
"""

from __future__ import annotations

import math
from collections import OrderedDict
from dataclasses import dataclass, replace

from hapticvlm import backoff
from hapticvlm.evidence.ambient import Ambient, SceneView, ambient, distance, is_informative
from hapticvlm.evidence.reading import Reading

VIEW_EVERY_S = 0.5
SETTLE_S = 2.0
ASK_EVERY_S = 10.0
LATE_S = 120.0  # after this long without an answer a question counts as failed
LONGEST_PAUSE_S = 300.0
# Cosine distance of our encoder between frames: 0.05 (median) from one step of a slow orbit to the
# next, 0.4 to 0.7 between views of one room, 0.6 to 0.8 between outdoor pictures of one weather.
NEW_VIEW = 0.5
NEW_LIGHT = 0.25  # of full brightness
MAX_VIEWS = 32
READINGS = 4
TAU_S = 5.0
STEP_C = 0.5  # changes of less are not worth a new decision


@dataclass(slots=True)
class _View:
    scene_view: SceneView
    reading: Reading | None = None


class Surroundings:
    """The temperature that the scene states, readings of its frames, and the ambient from both."""

    def __init__(self, *, can_ask: bool = False) -> None:
        self._can_ask = can_ask
        self._views: OrderedDict[int, _View] = OrderedDict()
        self._numbers = 0
        self._here: int | None = None
        self._seen: SceneView | None = None
        self._candidate: tuple[SceneView, float] | None = None
        self._viewed_at = self._asked_at = float("-inf")
        self._asking: int | None = None
        self._failures = 0
        self._climate: OrderedDict[int, Reading] = OrderedDict()
        self._believed = self._rendered = ambient(None)
        self._updated_at: float | None = None
        self._given: Ambient | None = None
        self.ambient = self._rendered  # to render with, as of the last `update`; degC

    def wants_scene_view(self, now: float) -> bool:
        """Whether to recognise a live frame as a whole now; it then counts as recognised."""
        if not self._can_ask or self.scene_c is not None:
            return False
        if 0.0 <= now - self._viewed_at < VIEW_EVERY_S:
            return False
        self._viewed_at = now
        return True

    def update_view(self, scene_view: SceneView | None, now: float) -> int | None:
        """Receive the newest scene view; return the number of the view to ask about, if any.

        None: it has not changed. A view settles, or is asked about again, although it stands still.
        """
        self._seen = scene_view = scene_view or self._seen
        if scene_view is None:
            return None
        known = self._find(scene_view)
        if known is not None and known == self._here:
            self._candidate = None
            return None
        if not self._has_settled(scene_view, now):
            return None
        if known is not None:
            self._enter(known)
            return None
        return self._question(scene_view, now)

    def add_reading(self, view: int, reading: Reading, now: float) -> None:
        """Receive the answer to the question about `view`."""
        self._answered(view)
        self._failures = 0
        if view in self._views and is_informative(reading):
            self._views[view].reading = reading
            self.update(now)
            self._join_climate(view, reading)
            self.update(now)

    def fail(self, view: int) -> None:
        """Note that the question about `view` has no answer: ask again later, and less often."""
        self._answered(view)
        self._views.pop(view, None)
        self._failures += 1
        if self._here == view:
            self._here = None

    @property
    def scene_c(self) -> float | None:
        """The ambient that the scene itself gives, degC, or None."""
        return None if self._given is None else self._given.value_c

    @scene_c.setter
    def scene_c(self, value_c: float) -> None:
        self._given = self.ambient = ambient(value_c)

    def update(self, now: float) -> None:
        """Move the ambient that is rendered towards what is believed; call it often."""
        self._approach_belief(now)
        self.ambient = self._rendered if self._given is None else self._given

    def _approach_belief(self, now: float) -> None:
        target = self._believed
        since = self._updated_at
        if target is self._rendered:
            self._updated_at = now
            return
        if since is None or target.source != self._rendered.source or target == self._rendered:
            self._rendered = target
            self._updated_at = now
            return
        share = -math.expm1(-max(0.0, now - since) / TAU_S)
        step_c = share * (target.value_c - self._rendered.value_c)
        left_c = abs(target.value_c - self._rendered.value_c) - abs(step_c)
        if left_c < STEP_C:
            self._rendered = target
            self._updated_at = now
        elif abs(step_c) >= STEP_C:
            value_c = self._rendered.value_c + step_c
            low_c = min(value_c, target.low_c)
            high_c = max(value_c, target.high_c)
            self._rendered = replace(target, value_c=value_c, low_c=low_c, high_c=high_c)
            self._updated_at = now

    def _find(self, scene_view: SceneView) -> int | None:
        for number, view in self._views.items():
            if _is_alike(view.scene_view, scene_view):
                return number
        return None

    def _has_settled(self, scene_view: SceneView, now: float) -> bool:
        """Whether this new view has lasted; the very first one need not."""
        if self._here is None and not self._climate:
            return True
        if self._candidate is None or not _is_alike(self._candidate[0], scene_view):
            self._candidate = (scene_view, now)
        return now - self._candidate[1] >= SETTLE_S

    def _enter(self, view: int) -> None:
        self._here = view
        self._candidate = None
        self._views.move_to_end(view)
        reading = self._views[view].reading
        if reading is not None:
            self._join_climate(view, reading)

    def _question(self, scene_view: SceneView, now: float) -> int | None:
        if self._asking is not None and now - self._asked_at > LATE_S:
            self.fail(self._asking)
        pause_s = backoff.pause_s(self._failures + 1, ASK_EVERY_S, LONGEST_PAUSE_S)
        if self._asking is not None or now - self._asked_at < pause_s:
            return None
        self._numbers += 1
        self._asking = self._numbers
        self._asked_at = now
        self._views[self._numbers] = _View(scene_view)
        self._enter(self._numbers)
        if len(self._views) > MAX_VIEWS:
            self._views.popitem(last=False)
        return self._numbers

    def _is_same_place(self, view: int) -> bool:
        """Whether this view differs from one of the climate's in its light alone."""
        scene_view = self._views[view].scene_view
        others = [self._views[other].scene_view for other in self._climate if other in self._views]
        return any(distance(other, scene_view) <= NEW_VIEW for other in others)

    def _answered(self, view: int) -> None:
        if self._asking == view:
            self._asking = None

    def _join_climate(self, view: int, reading: Reading) -> None:
        """Join the climate believed in, or begin a new one when the reading contradicts it."""
        held = [other for number, other in self._climate.items() if number != view]
        contradicts = held and not _overlap(ambient(None, held), reading)
        if contradicts and not self._is_same_place(view):
            self._climate.clear()
        self._climate[view] = reading
        self._climate.move_to_end(view)
        while len(self._climate) > READINGS:
            self._climate.popitem(last=False)
        self._believed = ambient(None, tuple(self._climate.values()))


def _is_alike(view: SceneView, other: SceneView) -> bool:
    dimmed = abs(view.brightness - other.brightness)
    return distance(view, other) <= NEW_VIEW and dimmed <= NEW_LIGHT


def _overlap(believed: Ambient, reading: Reading) -> bool:
    return reading.low_c <= believed.high_c and believed.low_c <= reading.high_c

"""Simulated scenes that send at a fixed rate, each with one frame under way at a time.

A frame that cannot be sent before the next one is due is superseded by it. An answer that comes
later than the plan allows is stale. Both are counted, and neither delays the frames after it: a
scene that waited would send less to a slow recogniser, and so hide that it is slow.
"""

from __future__ import annotations

import random
import threading
import time
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import msgspec
import numpy as np

from hapticvlm import captures
from hapticvlm.http_client import HttpError, read_address
from hapticvlm.messages import Frame
from hapticvlm.vision import pictures
from hapticvlm.vision.encoders.encoder import Encoder
from hapticvlm.vision.pictures import Crop
from hapticvlm.vision.remote import contract
from hapticvlm.vision.remote.contract import Answer, Result
from hapticvlm.vision.remote.exchange import Exchange
from hapticvlm_recogniser_app.replies import Named

MOST = 64
BELIEF_ERROR = 1e-4  # between two processors, for the same embedding


def recorded(path: Path, encoder: Encoder) -> list[Crop]:
    """Cut the objects out of MOST frames of a capture, evenly and in order. Raises CaptureError."""
    frames = [line for line in captures.read(path).lines() if line.type == "frame"]
    chosen = frames[:: max(1, len(frames) // MOST)][:MOST]
    crops = []
    for line in chosen:
        fields = {"type": "frame", "id": 1, "captured_at": line.t_s, **line.message()}
        frame = msgspec.convert(fields, Frame)
        crops.append(pictures.crop(frame, encoder.side))
    return crops


class Truth:
    """Judges answers: one is right if the gallery it names, and no other, gives its beliefs."""

    def __init__(self, galleries: Sequence[Named]) -> None:
        self._galleries: Mapping[str, Named] = {named.identity.hash: named for named in galleries}

    def is_right(self, hash: str, result: Result) -> bool:
        """Return whether the beliefs are those of the gallery with this hash, and of no other."""
        return [name for name, named in self._galleries.items() if _is_of(named, result)] == [hash]


def _is_of(named: Named, result: Result) -> bool:
    embedding = np.frombuffer(result.embedding, "<f4").astype(np.float32)
    beliefs = dict(result.beliefs)
    # The answer does not say whether the picture was flat, so either scale may be its own.
    either = [dict(named.gallery.match(embedding, is_flat=flat).beliefs) for flat in (False, True)]
    return any(
        wanted.keys() == beliefs.keys()
        and all(abs(wanted[name] - beliefs[name]) <= BELIEF_ERROR for name in wanted)
        for wanted in either
    )


@dataclass(frozen=True, slots=True)
class Plan:
    """Number of scenes, their rate and duration, and the greatest age of an answer, ms."""

    scenes: int
    rate_hz: float
    seconds: float
    max_age_ms: float
    gallery: str


@dataclass(slots=True)
class Tally:
    """The outcome of the frames of one scene."""

    offered: int = 0
    answered: int = 0
    superseded: int = 0
    stale: int = 0
    failed: int = 0
    wrong: int = 0
    ages_ms: list[float] = field(default_factory=list)
    answered_at: list[float] = field(default_factory=list)
    batches: Counter[int] = field(default_factory=Counter)
    hashes: Counter[str] = field(default_factory=Counter)
    last_hash: str = ""
    reasons: Counter[str] = field(default_factory=Counter)


class Scenes:
    """The scenes of one run; `start`, then `finish`."""

    def __init__(self, url: str, plan: Plan, crops: Sequence[Crop], truth: Truth) -> None:
        self._url = url
        self._plan = plan
        self._truth = truth
        wait_ms = plan.max_age_ms
        self._bodies = [
            contract.write_request([crop], plan.gallery, wait_ms=wait_ms) for crop in crops
        ]
        self.tallies = [Tally() for _ in range(plan.scenes)]
        self._threads = [
            threading.Thread(target=self._play, args=(number,), daemon=True)
            for number in range(plan.scenes)
        ]

    def start(self) -> None:
        """Start all scenes at once, each at its own phase."""
        self._began = time.monotonic() + 0.5
        for thread in self._threads:
            thread.start()

    def finish(self) -> list[Tally]:
        """Wait for the end."""
        for thread in self._threads:
            thread.join()
        return self.tallies

    def _play(self, scene: int) -> None:
        plan = self._plan
        tally = self.tallies[scene]
        exchange = Exchange(read_address(self._url, "url"), None)
        phase = random.Random(scene).random() / plan.rate_hz
        began = self._began + phase
        number = 0
        while (due := began + number / plan.rate_hz) < began + plan.seconds:
            time.sleep(max(0.0, due - time.monotonic()))
            # If the last answer took longer than a period, frames are due whose time has passed:
            # only the newest is sent, as a scene does.
            newest = max(number, int((time.monotonic() - began) * plan.rate_hz))
            newest = min(newest, int(plan.seconds * plan.rate_hz) - 1)
            tally.offered += 1 + max(0, newest - number)
            tally.superseded += max(0, newest - number)
            number = max(number, newest)
            self._recognise(exchange, tally, scene, number, began + number / plan.rate_hz)
            number += 1
        exchange.close()

    def _recognise(
        self, exchange: Exchange, tally: Tally, scene: int, number: int, captured: float
    ) -> None:
        crop = (number + 7 * scene) % len(self._bodies)
        until = captured + self._plan.max_age_ms / 1000.0
        try:
            data = exchange.ask("POST", contract.RECOGNISE, self._bodies[crop], until)
            answer = msgspec.msgpack.decode(data, type=Answer)
        except (HttpError, msgspec.MsgspecError) as error:
            late = time.monotonic() >= until
            tally.stale += late
            tally.failed += not late
            tally.reasons[str(error)[:60]] += 1
            return
        tally.answered += 1
        now = time.monotonic()
        tally.answered_at.append(now)
        tally.ages_ms.append((now - captured) * 1000.0)
        tally.batches[answer.batch] += 1
        tally.hashes[answer.hash] += 1
        tally.last_hash = answer.hash
        tally.wrong += not self._truth.is_right(answer.hash, answer.results[0])

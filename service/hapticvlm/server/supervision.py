"""Runs the periodic work of the gateway: ticks, telemetry, checks of children, reports of losses.

Leases that lapsed end here, the plate is followed, and what fails is reported to every connection.
"""

from __future__ import annotations

import gc
import logging
import time
from collections.abc import Callable, Iterator

from hapticvlm.devices.faults import describe
from hapticvlm.messages import Error
from hapticvlm.server import status
from hapticvlm.server.connection import Event
from hapticvlm.server.counters import DROPPED_FRAMES
from hapticvlm.server.edge.scheduling import yield_to_io
from hapticvlm.server.gateway import Gateway
from hapticvlm.server.news import HelperNews, News

TICK_S = 0.02
REST_TICK_S = 0.1  # while nobody is connected: no lease can lapse
CHILDREN_S = 0.1  # between checks of the children; to start one again takes longer
TELEMETRY_S = 0.1
LOSSES_S = 10.0
YOUNG = 1000  # objects made and not freed since the last collection; then it is time for one

logger = logging.getLogger(__name__)


class Supervision:
    """Runs the periodic work of one gateway."""

    def __init__(self, gateway: Gateway) -> None:
        self._gateway = gateway
        self._lost_lines, self._losses_at = 0, float("-inf")
        self._supervised_at = self._telemetry_at = float("-inf")
        self._waveform_from = 0
        self._speaker_level = 0.0  # for the next telemetry
        self._remote_news = HelperNews()
        self._worn_faults: set[tuple[str, str]] = set()

    async def run(self) -> None:
        """Run until cancelled."""
        gateway = self._gateway
        while True:
            # With nobody connected no lease can lapse and no frame waits: the loop wakes ten times
            # a second instead of fifty. The first client to come finds its first tick at most a
            # tenth of a second late, well within a lease.
            await gateway.scheduler.wait(TICK_S if gateway.connections else REST_TICK_S)
            now = time.monotonic()
            self._follow_plate(now)
            for work in self._due(now):
                await yield_to_io()  # a touch that has come meanwhile goes between
                work()

    def _tick(self) -> None:
        """End lapsed leases, and move the plate."""
        gateway = self._gateway
        if gateway.owner is None:
            return
        now = time.monotonic()  # later than every message that the session has received meanwhile
        if gateway.leases:
            gateway.ownership.leased_at = now
        # A lease ends here and nowhere else on this side: no timer is set for each touch, the tick
        # looks at all of them 50 times a second. Should the loop be held up, outputs still end by
        # themselves: the engine knows when each command expires, the board how long its setpoint
        # lives.
        gateway.deliver(gateway.owner, gateway.owner.session.tick(now, gateway.outputs.reading))

    def _plan_vibration(self) -> None:
        if self._gateway.owner is not None:
            self._gateway.vibration.tick(time.monotonic())

    def _due(self, now: float) -> Iterator[Callable[[], None]]:
        """Yield the work that is due, each item for a turn of the loop."""
        yield self._tick
        if self._gateway.vibration.is_on:
            yield self._plan_vibration
        if now - self._supervised_at >= CHILDREN_S:
            self._supervised_at = now
            yield self._supervise
        # A recogniser that has just come back has nobody else to wake it, nor has a frame that had
        # to wait for its turn.
        if self._gateway.recognition.is_waiting:
            yield self._gateway.recognition.feed
        if now >= self._telemetry_at:
            # Ten a second in the long run; what a held up loop has missed is not made up for.
            self._telemetry_at = max(self._telemetry_at, now - TICK_S) + TELEMETRY_S
            # Two turns of the loop: to read a tenth of a second of samples takes as long as a tick.
            yield self._hear_speaker
            yield self._send_telemetry
        if gc.get_count()[0] >= YOUNG:
            yield self._collect
        if any("waveform" in other.watches for other in self._gateway.connections):
            yield self._send_waveform

    def _collect(self) -> None:
        """Free reference cycles."""
        # By itself Python does it when 50,000 objects have been made (`run_service.py`), in the
        # middle of a touch or not. asyncio leaves such a cycle of each connection, 1 kB: an
        # hour of coming and going was 9 MB. Here, while the loop is idle, the youngest generation
        # takes 0.3 ms, and 0.8 after a scene of 8,192 objects came. All generations take
        # milliseconds, so they wait until nobody is connected.
        if not self._gateway.connections:
            gc.collect()
        else:
            gc.collect(1 if gc.get_count()[1] >= gc.get_threshold()[1] else 0)

    def _hear_speaker(self) -> None:
        self._speaker_level = self._gateway.outputs.speaker.loudest()

    def _send_telemetry(self) -> None:
        """Report the state of the outputs to every connection."""
        telemetry = status.telemetry(
            self._gateway.outputs,
            speaker_level=self._speaker_level,
            dropped_frames=sum(self._gateway.counts[count] for count in DROPPED_FRAMES),
            leases=self._gateway.leases,
        )
        event = Event(telemetry)
        for connection in self._gateway.connections:
            connection.post(event)

    def _send_waveform(self) -> None:
        """Send what the speaker plays to the observers that watch it."""
        waveform = status.waveform(
            self._gateway.outputs.speaker, self._waveform_from, self._gateway.touching
        )
        self._waveform_from = (waveform.start or 0) + len(waveform.samples or ())
        if waveform.samples:
            event = Event(waveform)
            for connection in self._gateway.connections:
                if "waveform" in connection.watches:
                    connection.post(event)

    def _follow_plate(self, now: float) -> None:
        before = self._gateway.outputs.reading.faults
        new = self._gateway.outputs.follow(now)
        for fault in set(before) - set(self._gateway.outputs.reading.faults):
            logger.warning("plate fault gone: %s", fault)
        for fault in new:
            self._report(Error(id=0, code="device", text=f"plate fault: {describe(fault)}"))
        if new:
            self._gateway.stop("peltier")

    def _supervise(self) -> None:
        now = time.monotonic()
        # Each child is checked ten times a second, and started again in a thread of its own, so
        # nothing here waits for a process. A check in every tick was half of what a tick cost, and
        # a touch that meets a tick waits for its end. A request to a child that died is answered at
        # once by an error: its client must not wait for a restart of seconds.
        trouble = self._gateway.outputs.speaker.supervise(now)
        if trouble is not None:
            self._rest_owner()
            self._report(Error(id=0, code="device", text=trouble))
        worn = {(out.name, fault) for out in self._gateway.outputs.worn for fault in out.faults}
        for name, fault in worn - self._worn_faults:
            self._report(Error(id=0, code="device", text=f"{name}: {describe(fault)}"))
        self._worn_faults = worn
        quiet = self._gateway.outputs.speaker.watch_state()
        if quiet is not None:
            self._report(Error(id=0, code="device", text=quiet))
        trouble = self._gateway.recogniser.worker.supervise(now)
        if trouble is not None:
            self._gateway.recognition.fail(trouble)
            self._report(Error(id=0, code="model", text=trouble))
        self._gateway.recognition.answer_without(now)
        trouble = None if self._gateway.vlm is None else self._gateway.vlm.supervise(now)
        if trouble is not None:
            self._report(Error(id=0, code="model", text=trouble))
        self._note_remote(now)
        if self._gateway.vlm is not None:
            self._tell(self._gateway.vlm.news.take())
        self._report_losses(now)

    def _note_remote(self, now: float) -> None:
        """Note how the shared recogniser answers, once it was asked."""
        remote = self._gateway.recogniser.remote
        if remote is not None and (remote.is_used or remote.reason):
            error = None if remote.is_used else f"{remote.reason}; pictures are recognised here"
            self._remote_news.note("the shared recogniser", error, now)
        news = self._remote_news.take()
        if news is not None and not news.is_good:  # the log has both from `RecogniserWorker.note`
            self._send(Error(id=0, code="model", text=news.text))

    def _tell(self, news: News | None) -> None:
        """Log the news of a helper; report it to every connection if it is bad."""
        if news is not None and news.is_good:
            logger.warning("%s", news.text)  # a level that reaches the terminal, as the failure did
        elif news is not None:
            self._report(Error(id=0, code="model", text=news.text))

    def _report_losses(self, now: float) -> None:
        """Report that the record misses lines, when it begins and from time to time."""
        lost = 0 if self._gateway.recorder is None else self._gateway.recorder.lost
        # A full disk loses hundreds of lines a second, and each would be an error to every
        # connection. The first is reported at once, then the sum from time to time.
        if lost <= self._lost_lines or now - self._losses_at < LOSSES_S:
            return
        self._lost_lines = lost
        self._losses_at = now
        text = f"the record misses {lost} lines: free the disk, or record without pictures"
        self._report(Error(id=0, code="overload", text=text))

    def _rest_owner(self) -> None:
        if self._gateway.owner is not None:
            self._gateway.owner.session.rest()
        self._gateway.vibration.rest()
        self._gateway.outputs.plate.rest(time.monotonic())

    def _report(self, error: Error) -> None:
        logger.error("%s", error.text)
        self._send(error)

    def _send(self, error: Error) -> None:
        """Send an error to every connection."""
        self._gateway.refuse(error.code)
        event = Event(error)
        for connection in self._gateway.connections:
            connection.post(event)

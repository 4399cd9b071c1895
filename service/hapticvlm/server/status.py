"""Reports the parts of the service: figures of the status page, telemetry, the waveform."""

from __future__ import annotations

import time
from dataclasses import asdict
from typing import Any

from hapticvlm.devices.faults import describe
from hapticvlm.devices.speaker.speaker import Speaker
from hapticvlm.messages import Telemetry, View
from hapticvlm.recordings.recorder import Recorder
from hapticvlm.server.gateway import Gateway
from hapticvlm.server.log_writer import LOST
from hapticvlm.server.outputs import Outputs
from hapticvlm.server.vlm_queue import VlmQueue
from hapticvlm.session.hands import NAMES, Hand
from hapticvlm.session.targets import ObjectTarget
from hapticvlm.statistics import percentile
from hapticvlm.vision.worker import RecogniserWorker

WAITS = 512
VIEW_SAMPLES = 4800
VIEW_STEP = 16
VIEW_DIGITS = 5


def of_service(gateway: Gateway) -> dict[str, Any]:
    """Report every count and every part, for the status page."""
    owner = gateway.owner
    counts = sum((other.counts for other in gateway.connections), gateway.counts.copy())
    return {
        "connections": len(gateway.connections),
        "owner": owner.name if owner else None,
        "owner_idle_s": round(time.monotonic() - gateway.ownership.leased_at, 1) if owner else None,
        "counts": {**counts, LOST: 0 if gateway.log is None else gateway.log.lost},
        **_of_outputs(gateway.outputs),
        "leases": gateway.leases,
        "recogniser": _of_recogniser(gateway.recogniser),
        "vlm": _of_vlm(gateway.vlm),
        "record": _of_record(gateway.recorder),
    }


def _of_outputs(outputs: Outputs) -> dict[str, Any]:
    """Report speaker and plate, and what a stop still holds."""
    return {
        "speaker": _of_speaker(outputs.speaker),
        "plate": {
            "name": outputs.plate.name,
            "simulated": outputs.plate.simulated,
            "setpoint_c": outputs.reading.setpoint_c,
            "plate_c": outputs.reading.plate_c,
            "dose_cem43": outputs.reading.dose_cem43,
            "heated_s": outputs.reading.heated_s,
            "faults": {name: describe(name) for name in outputs.reading.faults},
            "counts": outputs.plate.counts,
        },
        "worn": {
            output.name: {"state": output.state, "faults": list(map(describe, output.faults))}
            for output in outputs.worn
        },
        "held": {hand: outputs.hold.outputs(hand) for hand in NAMES},
    }


def _of_recogniser(recogniser: RecogniserWorker) -> dict[str, Any]:
    """Report the recogniser."""
    return {
        "restarts": recogniser.worker.restarts,
        "pid": recogniser.worker.pid,
        "ready": recogniser.worker.is_ready,
        "busy_s": round(recogniser.worker.busy_s, 3),
        "encoder": recogniser.loaded.encoder,
        "remote": None if recogniser.remote is None else asdict(recogniser.remote),
    }


def _of_vlm(queue: VlmQueue | None) -> dict[str, Any] | None:
    """Report the vision-language model, if there is one, and what it was asked."""
    if queue is None:
        return None
    vlm = queue.worker
    return {
        "name": vlm.name,
        "remote": vlm.settings.url is not None,
        "absent": vlm.absent,
        "busy": vlm.is_busy,
        "restarts": vlm.worker.restarts,
        "pid": vlm.worker.pid,
        "answered": queue.answered,
        "failed": queue.failed,
        "dropped": queue.dropped,
        "last_error": queue.last_error,
    }


def _of_record(recorder: Recorder | None) -> dict[str, Any] | None:
    """Report the record, if sessions are kept: whether lines of it are lost."""
    if recorder is None:
        return None
    return {
        "folder": str(recorder.folder),
        "written_bytes": recorder.written_bytes,
        "lost_lines": recorder.lost,
    }


def telemetry(
    outputs: Outputs, *, speaker_level: float, dropped_frames: int, leases: int
) -> Telemetry:
    """Write the state of the outputs as every connection gets it."""
    plate = outputs.reading
    return Telemetry(
        id=0,
        plate_c=plate.plate_c,
        setpoint_c=plate.setpoint_c,
        sink_c=plate.sink_c,
        duty=plate.duty,
        speaker_level=speaker_level,
        underruns=outputs.speaker.underruns,
        dropped_frames=dropped_frames,
        leases=leases,
        faults=outputs.faults,
    )


def waveform(speaker: Speaker, start: int, touching: Hand | None) -> View:
    """Write the samples played from number `start` (thinned out) on, at most the newest 0.1 s.

    With them goes what the hand does that touches now, if one does.
    """
    end, samples = speaker.waveform_until(VIEW_SAMPLES + VIEW_STEP)
    # An observer gets each sample once. `start` is where the last view ended; if that is still
    # within the newest stretch the view goes on there, else the loop was held up, and a gap is
    # better than sound that lags further and further behind.
    first = max(end - VIEW_SAMPLES, 0)
    if first <= start * VIEW_STEP <= end:
        first = start * VIEW_STEP
    first += -first % VIEW_STEP
    kept = samples[samples.size - (end - first) :][::VIEW_STEP]
    target = None if touching is None else touching.target
    return View(
        id=0,
        kind="waveform",
        object_id=target.object_id if isinstance(target, ObjectTarget) else None,
        speed_mps=None if touching is None else touching.motion.speed_mps,
        rate_hz=48_000 / VIEW_STEP,
        start=first // VIEW_STEP,
        samples=[round(sample, VIEW_DIGITS) for sample in kept.tolist()],
    )


def _of_speaker(speaker: Speaker) -> dict[str, Any]:
    engine = speaker.status()
    return {
        "name": speaker.name,
        "simulated": speaker.simulated,
        "realtime": engine.realtime,
        "level": engine.level,
        "underruns": speaker.underruns,
        "lost_commands": engine.lost,
        "scrubbed": engine.scrubbed,
        "restarts": speaker.restarts,
        "command_wait_ms": _command_wait_ms(speaker),
        "pid": speaker.pid,
        "plays": speaker.plays,
        "faults": {name: describe(name) for name in speaker.faults},
    }


def _command_wait_ms(speaker: Speaker) -> dict[str, float] | None:
    """Return how long the newest commands waited for the block that plays them, ms."""
    # Read from the ring's memory while the engine goes on writing: a wait may be of the command
    # that came a whole round later. As a figure among hundreds it does not matter, so nothing is
    # locked.
    newest = speaker.status().newest
    waits = speaker.delays(max(1, newest - WAITS + 1), newest) * 1000.0
    if not waits.size:
        return None
    return {
        "n": waits.size,
        "median": float(percentile(waits, 50.0)),
        "p99": float(percentile(waits, 99.0)),
    }

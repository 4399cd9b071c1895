"""The floor of the virtual clock: a bare loop on the same deadlines, which counts those it missed.

`python -m hapticvlm_lab.bench.audio.deadlines SECONDS BLOCK REALTIME` (1 or 0) renders nothing,
misses a deadline where the virtual clock counts an underrun, and prints one JSON object at the end.
"""

from __future__ import annotations

import gc
import json
import sys
import time

from hapticvlm.processes.priority import request_priority
from hapticvlm.rendering.vibration.vibration import RATE_HZ


def keep(seconds: float, block: int, *, realtime: bool) -> dict[str, object]:
    """Sleep from deadline to deadline; return how many were missed by more than a block."""
    has_priority = realtime and request_priority()
    gc.disable()
    period = block / RATE_HZ
    deadline = time.monotonic()
    ends_at = deadline + seconds
    missed = 0
    worst_s = 0.0
    while deadline < ends_at:
        deadline += period
        ahead = deadline - time.monotonic()
        if ahead > 0:
            time.sleep(ahead)
        elif ahead < -period:
            missed = missed + 1
            worst_s = max(worst_s, -ahead)
            deadline = time.monotonic()
    return {"missed": missed, "worst_ms": round(worst_s * 1000.0, 2), "realtime": has_priority}


if __name__ == "__main__":
    seconds, block, wants = sys.argv[1:]
    print(json.dumps(keep(float(seconds), int(block), realtime=wants == "1")))

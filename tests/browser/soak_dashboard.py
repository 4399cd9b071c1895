"""Watches the dashboard for a while: is its memory flat, and does it answer a hand at once?

Memory is the JavaScript heap after a collection with what its arrays hold, and the DOM's nodes.
Interactions are real clicks and keys; their time from the event to the next paint is the browser's
own (Event Timing API, in steps of 8 ms; below 16 ms it reports none, counted here as 16). Frames
are the times between animation frames, in steps of 0.5 ms: how smoothly it moves.
"""

from __future__ import annotations

import time
from itertools import cycle

import numpy as np
from playwright.sync_api import Browser, CDPSession

SHORTEST_MS = 16.0
TELEMETRY = '"type":"telemetry"'
STEP_MS, GAPS = 0.5, 2000
TIMER = """
const gaps = new Uint32Array(2000); // of 0.5 ms each, the last for all that are longer
let drawnAt = null;
requestAnimationFrame(function count(now) {
  if (drawnAt !== null) gaps[Math.min(gaps.length - 1, Math.round(2 * (now - drawnAt)))]++;
  drawnAt = now;
  requestAnimationFrame(count);
});
window.frameGaps = () => [...gaps];
window.forgetFrames = () => gaps.fill(0);
const longest = new Map();
new PerformanceObserver((list) => {
  for (const { interactionId, duration } of list.getEntries()) {
    const before = longest.get(interactionId) ?? 0;
    if (interactionId) longest.set(interactionId, Math.max(duration, before));
  }
}).observe({ type: "event", durationThreshold: 16 });
window.interactionTimes = () => [...longest.values()];
"""


def soak(browser: Browser, address: str, seconds: float) -> dict[str, float]:
    """Use the dashboard at this address once a second, weigh it each two; return what was seen.

    The first 8 s are not counted: each object is touched once then. Growth is that of the second
    half's median heap, and of its largest number of nodes, above the first half's.
    """
    page = browser.new_page(viewport={"width": 1280, "height": 900})
    telemetries = [0]

    def count(data: str | bytes) -> None:
        telemetries[0] += isinstance(data, str) and TELEMETRY in data

    page.on("websocket", lambda socket: socket.on("framereceived", count))
    page.add_init_script(TIMER)
    page.goto(address)
    page.locator("#more > summary").click()  # the log is in it
    tools = page.context.new_cdp_session(page)
    page.wait_for_timeout(8000)
    page.evaluate("forgetFrames()")
    uses = (
        lambda: page.locator("#objects button").first.click(),
        lambda: page.keyboard.press("Tab"),
        lambda: page.click("#newest"),
        lambda: page.click("#follow-log"),
        lambda: page.keyboard.press("Escape"),
        lambda: page.locator("#objects button").last.click(),
    )
    telemetries[0], started = 0, time.monotonic()
    memory, used = [_weigh(tools)], 0
    for use in cycle(uses):
        if (now_s := time.monotonic() - started) >= seconds:
            break
        if now_s >= 2.0 * len(memory):
            memory.append(_weigh(tools))
        use()
        used += 1
        page.wait_for_timeout(1000)
    rate_hz = telemetries[0] / (time.monotonic() - started)
    page.wait_for_timeout(500)
    painted: list[float] = page.evaluate("interactionTimes()")
    gaps = np.repeat(np.arange(GAPS) * STEP_MS, page.evaluate("frameGaps()"))
    page.close()
    times = np.array(painted + [SHORTEST_MS] * max(0, used - len(painted)))
    heap_mb, nodes = np.array(memory).T
    half = len(memory) // 2
    return {
        "telemetry_hz": rate_hz,
        "interactions": used,
        "median_ms": float(np.median(times)),
        "p98_ms": float(np.percentile(times, 98)),
        "frames": gaps.size,
        "frame_p98_ms": float(np.percentile(gaps, 98)),
        "growth_mb": float(np.median(heap_mb[half:]) - np.median(heap_mb[:half])),
        "node_growth": float(nodes[half:].max() - nodes[:half].max()),
    }


def _weigh(tools: CDPSession) -> tuple[float, int]:
    """Return the heap, MB, and the number of nodes."""
    tools.send("HeapProfiler.collectGarbage")
    heap = tools.send("Runtime.getHeapUsage")
    size = heap["usedSize"] + heap.get("backingStorageSize", 0)
    return size / 1e6, tools.send("Memory.getDOMCounters")["nodes"]

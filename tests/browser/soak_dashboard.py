"""Watches the dashboard for long: is its memory flat, and does it answer a hand at once?

    python tests/browser/soak_dashboard.py --seconds 600

A scripted scene strokes and shows frames, so that telemetry and waveforms come ten times a second
and decisions with every frame. Memory is the JavaScript heap after a collection with what its
arrays hold, and the DOM's nodes. Interactions are real clicks and keys; their time from the event
to the next paint is the browser's own (Event Timing API, in steps of 8 ms; below 16 ms it reports
none, counted here as 16). Frames are the times between animation frames, in steps of 0.5 ms: how
smoothly it moves. Prints a table and, last, one JSON line.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import time
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass
from itertools import cycle

import numpy as np
from dashboard_scene import chromium, touching
from playwright.sync_api import Browser, CDPSession, Page
from toolchains import missing

from hapticvlm.client.local_service import running

WARM_UP_S = 12.0  # each object was touched once
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


@dataclass(frozen=True)
class Memory:
    """The page's memory at one moment, after a collection."""

    at_s: float
    heap_mb: float
    nodes: int
    listeners: int


@dataclass(frozen=True)
class Soak:
    """What was seen."""

    seconds: float
    telemetry_hz: float
    interactions: int
    median_ms: float
    p98_ms: float
    longest_ms: float
    frames: int
    frame_p98_ms: float
    frame_longest_ms: float
    memory: list[Memory]

    @property
    def growth_mb(self) -> float:
        """The second half's median heap above the first half's."""
        heap = [moment.heap_mb for moment in self.memory]
        half = len(heap) // 2
        return float(np.median(heap[half:]) - np.median(heap[:half]))

    @property
    def node_growth(self) -> int:
        """The second half's largest number of nodes above the first half's."""
        nodes = [moment.nodes for moment in self.memory]
        half = len(nodes) // 2
        return max(nodes[half:]) - max(nodes[:half])


def soak(
    browser: Browser,
    address: str,
    seconds: float,
    *,
    every_s: float = 10.0,
    warm_up_s: float = WARM_UP_S,
) -> Soak:
    """Watch the dashboard at this address; use it once a second, weigh it `every_s`."""
    page = browser.new_page(viewport={"width": 1280, "height": 900})
    telemetries = [0]

    def count(data: str | bytes) -> None:
        telemetries[0] += isinstance(data, str) and TELEMETRY in data

    page.on("websocket", lambda socket: socket.on("framereceived", count))
    page.add_init_script(TIMER)
    page.goto(address)
    page.locator("#more > summary").click()  # the log is in it
    tools = page.context.new_cdp_session(page)
    page.wait_for_timeout(warm_up_s * 1000)
    page.evaluate("forgetFrames()")
    telemetries[0], started = 0, time.monotonic()
    memory, made = [_weigh(tools, 0.0)], 0
    for use in _uses(page):
        if (now_s := time.monotonic() - started) >= seconds:
            break
        if now_s >= memory[-1].at_s + every_s:
            memory.append(_weigh(tools, now_s))
        use()
        made += 1
        page.wait_for_timeout(1000)
    rate = telemetries[0] / (time.monotonic() - started)
    page.wait_for_timeout(500)
    seen: list[float] = page.evaluate("interactionTimes()")
    gaps = np.repeat(np.arange(GAPS) * STEP_MS, page.evaluate("frameGaps()"))
    page.close()
    times = np.array(seen + [SHORTEST_MS] * max(0, made - len(seen)))
    return Soak(
        seconds=round(time.monotonic() - started, 1),
        telemetry_hz=round(rate, 2),
        interactions=made,
        median_ms=float(np.median(times)),
        p98_ms=float(np.percentile(times, 98)),
        longest_ms=float(times.max()),
        frames=gaps.size,
        frame_p98_ms=float(np.percentile(gaps, 98)),
        frame_longest_ms=float(gaps.max()),
        memory=memory,
    )


def _uses(page: Page) -> Iterator[Callable[[], None]]:
    """Yield what a person does to the page, over and over."""
    return cycle(
        (
            lambda: page.locator("#objects button").first.click(),
            lambda: page.keyboard.press("Tab"),
            lambda: page.click("#newest"),
            lambda: page.click("#follow-log"),
            lambda: page.keyboard.press("Escape"),
            lambda: page.locator("#objects button").last.click(),
        )
    )


def _weigh(tools: CDPSession, at_s: float) -> Memory:
    tools.send("HeapProfiler.collectGarbage")
    heap = tools.send("Runtime.getHeapUsage")
    dom = tools.send("Memory.getDOMCounters")
    size = heap["usedSize"] + heap.get("backingStorageSize", 0)
    return Memory(round(at_s, 1), round(size / 1e6, 3), dom["nodes"], dom["jsEventListeners"])


def main() -> None:
    """Soak a service of its own and print what was seen."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--seconds", type=float, default=600.0)
    arguments = parser.parse_args()
    if reason := missing("chromium", "axe-core"):
        raise SystemExit(reason)
    with running() as service, touching(service.url), chromium() as browser:
        version = browser.version
        found = soak(browser, service.page, arguments.seconds)
    print(f"{'at, s':>8}{'heap, MB':>10}{'nodes':>8}{'listeners':>11}")
    for moment in found.memory:
        print(f"{moment.at_s:8.0f}{moment.heap_mb:10.3f}{moment.nodes:8}{moment.listeners:11}")
    surroundings = {
        "chromium": version,
        "python": platform.python_version(),
        "device": f"{platform.machine()}, {os.cpu_count()} cpus, load {os.getloadavg()[0]:.1f}",
    }
    result = asdict(found) | {"growth_mb": round(found.growth_mb, 3), "memory": None}
    print(json.dumps(result | {"node_growth": found.node_growth} | surroundings))


if __name__ == "__main__":
    main()

"""All 50 trials of a study in a real headless Chromium, with the study killed half-way."""

import contextlib
import json
import os
import shutil
import signal
import socket
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

pytestmark = pytest.mark.browser

READY_S = 180.0
STEP_MS = 120_000
KILLED_AFTER = 25
QUICK = """
[[pattern]]
name = "{name}-{temperature}"
vibration = "{name}"
temperature = "{temperature}"
material = "{material}"
interaction = "{interaction}"
setpoint_c = {setpoint_c}
seconds = 0.2
"""
VIBRATIONS = (
    ("carving", "wood", "carve"),
    ("tapping", "glass", "tap"),
    ("striking", "wood", "strike"),
    ("rubbing", "fabric", "slide"),
    ("whooshing", "metal", "swing"),
)


def give_up(reason: str) -> None:
    if os.environ.get("CI"):
        pytest.fail(reason)
    pytest.skip(reason)


@pytest.fixture
def page() -> Iterator[Any]:
    chromium = shutil.which("chromium")
    if chromium is None:
        give_up("no chromium: apt-get install --no-install-recommends chromium")
    try:
        from playwright.sync_api import sync_playwright
    except ModuleNotFoundError:
        give_up("no playwright: pip install -e '.[dev]'")
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium, args=["--no-sandbox"])
        page = browser.new_page(viewport={"width": 1280, "height": 800})
        page.set_default_timeout(STEP_MS)
        faults: list[str] = []
        page.on("pageerror", lambda error: faults.append(str(error)))
        yield page
        browser.close()
        assert faults == []


@pytest.fixture
def patterns(tmp_path: Path) -> Path:
    path = tmp_path / "patterns.toml"
    path.write_text(
        "".join(
            QUICK.format(
                name=name,
                temperature=temperature,
                material=material,
                interaction=interaction,
                setpoint_c=setpoint_c,
            )
            for temperature, setpoint_c in (("hot", 33.0), ("cold", 31.0))
            for name, material, interaction in VIBRATIONS
        )
    )
    return path


@contextlib.contextmanager
def studying(folder: Path, patterns: Path, port: int) -> Iterator[subprocess.Popen[str]]:
    """A running `hapticvlm study run` on its own simulated service, with hardly any rest."""
    command = [sys.executable, "-m", "hapticvlm", "study", "run", str(folder)]
    command += ["--patterns", str(patterns), "--participants", "ann,ben", "--renderings", "1"]
    command += ["--rest", "0", "--settle-c", "20", "--port", str(port), "--masking-noise"]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    try:
        line = process.stdout.readline()
        assert line.startswith("study ready on http://127.0.0.1:")
        yield process
    finally:
        process.terminate()
        process.wait(30)
        process.stdout.close()


def free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


def log_of(folder: Path) -> list[dict[str, Any]]:
    lines = (folder / "ann.jsonl").read_text().split("\n")[:-1]
    return [json.loads(line) for line in lines]


def counted(folder: Path, kind: str) -> int:
    return sum(event["event"] == kind for event in log_of(folder))


def wait_until_asked(page: Any) -> None:
    page.locator("#prompt", has_text="Which pattern was it?").wait_for()


def answer_next(page: Any, folder: Path) -> None:
    """Feel one pattern and answer it: right, but every fifth as the pattern beside it."""
    wait_until_asked(page)
    open_trial = [event for event in log_of(folder) if event["event"] == "presented"][-1]
    cards = page.locator(".pattern")
    names = [cards.nth(i).get_attribute("data-pattern") for i in range(cards.count())]
    at = names.index(open_trial["pattern"])
    if open_trial["trial"] % 5 == 0:
        at = (at + 1) % len(names)
    if open_trial["trial"] % 2:
        page.keyboard.press("1234567890"[at])
    else:
        cards.nth(at).click()
    answered = open_trial["trial"] + 1
    page.locator(f"#progress[data-answered='{answered}']").wait_for()


def train(page: Any, folder: Path) -> None:
    page.locator("[data-participant=ann]").click()
    for felt in range(10):
        page.locator(".pattern.next").wait_for()
        page.keyboard.press("Space")
        page.locator(".pattern .dots", has_text="●").nth(felt).wait_for()
    page.locator("#go:enabled", has_text="Start the trials").wait_for()
    assert counted(folder, "felt") == 10
    page.keyboard.press("Space")


def test_fifty_trials_survive_a_kill_half_way(page: Any, patterns: Path, tmp_path: Path) -> None:
    folder, port = tmp_path / "study", free_port()
    with studying(folder, patterns, port) as study:
        page.goto(f"http://127.0.0.1:{port}/")
        train(page, folder)
        for _ in range(KILLED_AFTER):
            answer_next(page, folder)
        wait_until_asked(page)
        study.send_signal(signal.SIGKILL)
        study.wait(30)
    page.locator("#prompt", has_text="No connection").wait_for()
    before = log_of(folder)
    assert counted(folder, "answered") == KILLED_AFTER
    assert before[-1]["event"] in ("presented", "played")

    with studying(folder, patterns, port):
        page.locator("[data-participant=ann]", has_text="25 of 50").click()
        page.locator("#go", has_text="Go on").click()
        wait_until_asked(page)
        page.keyboard.press("p")
        page.locator("#prompt", has_text="Paused").wait_for()
        page.keyboard.press("Space")
        wait_until_asked(page)
        page.keyboard.press("Escape")
        page.locator("#prompt", has_text="Stopped").wait_for()
        page.locator("#go", has_text="Go on").click()
        while counted(folder, "answered") < 50:
            answer_next(page, folder)
        page.locator("#prompt", has_text="Thank you").wait_for()

    after = log_of(folder)
    answers = [event for event in after if event["event"] == "answered"]
    design = json.loads((folder / "study.json").read_text())
    assert after[: len(before)] == before
    assert [event["trial"] for event in answers] == list(range(50))
    assert [event["pattern"] for event in answers] == design["trials"]["ann"]
    assert set(Counter(event["pattern"] for event in answers).values()) == {5}
    assert answers[KILLED_AFTER]["attempt"] == 4  # killed, paused, stopped, answered
    assert all(0.0 < event["reaction_s"] < 600.0 for event in answers)
    assert all(event["seen_ms"] >= 0.0 for event in answers)
    assert sum(event["pattern"] == event["answered"] for event in answers) == 40
    assert all(e["speaker_level"] > 0.0 for e in after if e["event"] == "played")


def test_the_page_keeps_to_its_policy_and_never_learns_the_pattern_of_a_trial(
    page: Any, patterns: Path, tmp_path: Path
) -> None:
    folder, port = tmp_path / "study", free_port()
    heard: list[str] = []
    requests: list[str] = []
    page.on("request", lambda request: requests.append(request.url))
    page.on("websocket", lambda ws: ws.on("framereceived", lambda data: heard.append(str(data))))
    with studying(folder, patterns, port):
        answer = page.goto(f"http://127.0.0.1:{port}/study.html")
        train(page, folder)
        del heard[:]
        wait_until_asked(page)
        time.sleep(0.5)
        page.set_viewport_size({"width": 360, "height": 740})
        sizes = [box for box in map(_size, page.locator("button:visible").all()) if box]
        width = page.evaluate("() => document.documentElement.scrollWidth")
        stop = page.locator("#stop")
        page.mouse.wheel(0, 2000)
        box = stop.bounding_box()
        assert box is not None
        assert 0 <= box["y"] <= 740 - box["height"]
    assert "default-src 'self'" in answer.headers["content-security-policy"]
    assert all(url.startswith(f"http://127.0.0.1:{port}/") for url in requests)
    assert len(heard) >= 2
    shown = [json.loads(text) for text in heard if '"asking"' in text or '"playing"' in text]
    assert all(view["feeling"] is None for view in shown)
    assert not any(name in json.dumps(_without_pattern_list(v)) for v in shown for name in _NAMES)
    assert min(min(size) for size in sizes) >= 44
    assert width <= 360


def _size(button: Any) -> tuple[float, float] | None:
    box = button.bounding_box()
    return None if box is None else (box["width"], box["height"])


def _without_pattern_list(view: dict[str, Any]) -> dict[str, Any]:
    kept = ("phase", "answered", "trouble", "busy", "feeling", "next_to_feel", "participant")
    assert set(view) <= {*kept, *_PUBLIC}
    return {name: view[name] for name in kept}


_PUBLIC = {
    "patterns",
    "participants",
    "devices",
    "masking_noise",
    "renderings_wanted",
    "trials",
    "renderings",
    "is_trained",
}
_NAMES = [name for name, *_ in VIBRATIONS]

"""All trials of a study in a real headless Chromium, with the study killed half-way.

One sitting serves every test. Its trials are what takes the time, so there are four patterns, each
twice, and not the paper's ten, five times each.
"""

import contextlib
import json
import signal
import subprocess
import sys
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest
from pace import PACE
from playwright.sync_api import Browser, Page
from ports import free_port
from quick_patterns import NAMES, quick_patterns

pytestmark = [pytest.mark.nightly, pytest.mark.browser, pytest.mark.realtime]

STEP_MS = 120_000 * PACE
REPEATS = 2
TROUBLES_AT_MOST = 5  # before the test gives up
PATTERNS = 4
TRIALS = PATTERNS * REPEATS
KILLED_AFTER = TRIALS // 2
# A key of the number row as a French keyboard sends it: digits need Shift.
FRENCH_KEY = """([key, code]) => document.body.dispatchEvent(
  new KeyboardEvent("keydown", { key, code, bubbles: true }))"""
FILE = """
participants = ["ann", "ben"]
patterns = "{patterns}"
renderings = 1
repeats = {repeats}
rest_s = 0.0
settle_c = 20
masking_noise = true
"""
# Keeps every AudioContext that the page makes.
CONTEXTS = """
window.contexts = [];
const Native = AudioContext;
window.AudioContext = class extends Native {
  constructor(...given) {
    super(...given);
    contexts.push(this);
  }
};
"""
CODES = "(found) => found.map((button) => `${button.dataset.participant} ${button.className}`)"
NOISES = "() => contexts.map((context) => context.state).filter((state) => state !== 'closed')"


@dataclass
class Sat:
    """What one participant's sitting left behind, in the browser and in the study's folder."""

    folder: Path
    before: list[dict[str, Any]] = field(default_factory=list)  # the log when it was killed
    after: list[dict[str, Any]] = field(default_factory=list)
    policy: str = ""
    left_at: str = ""  # the page's address when all was answered
    address: str = ""
    faults: list[str] = field(default_factory=list)
    requests: list[str] = field(default_factory=list)
    heard: list[str] = field(default_factory=list)  # since the training ended
    button_sides: list[float] = field(default_factory=list)  # on a phone, px
    phone_width: float = 0.0
    stop_in_view: bool = False
    offered: list[str] = field(default_factory=list)  # codes, after the kill
    leaves: list[bool] = field(default_factory=list)  # whether another may be chosen here
    noises: dict[str, list[str]] = field(default_factory=dict)  # states of all audio, by moment


@pytest.fixture(scope="module")
def page(browser: Browser) -> Page:
    page = browser.new_page(viewport={"width": 1280, "height": 800})
    page.set_default_timeout(STEP_MS)
    page.add_init_script(CONTEXTS)
    return page


@pytest.fixture(scope="module")
def patterns(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("patterns") / "patterns.toml"
    path.write_text(quick_patterns(0.3))
    return path


@contextlib.contextmanager
def studying(folder: Path, patterns: Path, port: int) -> Iterator[subprocess.Popen[str]]:
    """A running `hapticvlm study run` on its own simulated service, with hardly any rest."""
    folder.mkdir(exist_ok=True)
    (folder / "study.toml").write_text(FILE.format(patterns=patterns, repeats=REPEATS))
    command = [sys.executable, "-m", "hapticvlm", "study", "run", str(folder), "--port", str(port)]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    try:
        line = process.stdout.readline()
        assert line.startswith("study ready on http://127.0.0.1:")
        yield process
    finally:
        process.terminate()
        process.wait(30 * PACE)
        process.stdout.close()


def log_of(folder: Path) -> list[dict[str, Any]]:
    lines = (folder / "ann.jsonl").read_text().split("\n")[:-1]
    return [json.loads(line) for line in lines]


def counted(folder: Path, kind: str) -> int:
    return sum(event["event"] == kind for event in log_of(folder))


def wait_until_asked(page: Any) -> None:
    reach(page, page.locator("#prompt", has_text="Which pattern was it?"))


def feel_next(page: Any) -> None:
    page.locator(".pattern.next").wait_for()
    page.keyboard.press("Space")


def reach(page: Any, wanted: Any, again: Callable[[], None] = lambda: None) -> None:
    """Wait for something; where the page reports trouble before that, go on as a person would.

    A machine with too much to do may play a pattern too late to count: the study says so.
    """
    trouble = page.locator("#alert:visible")
    for _ in range(TROUBLES_AT_MOST):
        wanted.or_(trouble).first.wait_for()
        if wanted.is_visible():
            return
        print("trouble:", trouble.text_content())
        page.locator("#go").click()
        trouble.wait_for(state="hidden")
        again()
    wanted.wait_for()


def answer_next(page: Any, folder: Path) -> None:
    """Feel one pattern and answer it: right, but every fifth as the pattern beside it."""
    wait_until_asked(page)
    open_trial = [event for event in log_of(folder) if event["event"] == "presented"][-1]
    cards = page.locator(".pattern")
    names = cards.evaluate_all("found => found.map((card) => card.dataset.pattern)")
    at = names.index(open_trial["pattern"])
    if open_trial["trial"] % 5 == 0:
        at = (at + 1) % len(names)
    if open_trial["trial"] % 4 == 1:
        page.evaluate(FRENCH_KEY, ["&é\"'"[at], f"Digit{at + 1}"])
    elif open_trial["trial"] % 2:
        page.keyboard.press("1234"[at])
    else:
        cards.nth(at).click()
    answered = open_trial["trial"] + 1
    page.locator(f"#progress[data-answered='{answered}']").wait_for()


def train(page: Any, folder: Path) -> None:
    page.locator("[data-participant=ann]").click()
    for felt in range(PATTERNS):
        feel_next(page)
        dots = page.locator(".pattern .dots", has_text="●").nth(felt)
        reach(page, dots, lambda: feel_next(page))
    page.locator("#go:enabled", has_text="Start the trials").wait_for()
    assert counted(folder, "felt") == PATTERNS
    page.keyboard.press("Space")


@pytest.fixture(scope="module")
def sat(page: Any, patterns: Path, tmp_path_factory: pytest.TempPathFactory) -> Sat:
    """Train, answer half the trials, be killed, go on, pause, stop and answer the rest."""
    port = free_port()
    sat = Sat(tmp_path_factory.mktemp("sitting") / "study")
    sat.address = f"http://127.0.0.1:{port}/"
    page.on("pageerror", lambda error: sat.faults.append(str(error)))
    page.on("request", lambda request: sat.requests.append(request.url))
    page.on("websocket", lambda ws: ws.on("framereceived", lambda d: sat.heard.append(str(d))))
    with studying(sat.folder, patterns, port) as study:
        sat.policy = page.goto(sat.address).headers["content-security-policy"]
        train(page, sat.folder)
        del sat.heard[:]
        for _ in range(KILLED_AFTER):
            answer_next(page, sat.folder)
        wait_until_asked(page)
        study.send_signal(signal.SIGKILL)
        study.wait(30 * PACE)
    page.locator("#prompt", has_text="No connection").wait_for()
    sat.before = log_of(sat.folder)
    with studying(sat.folder, patterns, port):
        go_on(page, sat)
        sat.noises["in a trial"] = page.evaluate(NOISES)
        page.evaluate("() => dispatchEvent(new PageTransitionEvent('pagehide'))")
        page.wait_for_timeout(200)
        sat.noises["left"] = page.evaluate(NOISES)
        page.locator("#masking-on").check()
        while counted(sat.folder, "answered") < TRIALS:
            answer_next(page, sat.folder)
        reach(page, page.locator("#prompt", has_text="Thank you"))
        sat.leaves.append(page.locator("#leave").is_visible())
        page.wait_for_timeout(200)
        sat.noises["done"] = page.evaluate(NOISES)
        sat.left_at = page.url
    sat.after = log_of(sat.folder)
    return sat


def go_on(page: Any, sat: Sat) -> None:
    """Take up the killed sitting; look at it on a phone, pause and stop."""
    page.locator("#prompt", has_text="Continue as ann?").wait_for()
    sat.offered = page.locator("#people button").evaluate_all(CODES)
    page.reload()  # a browser that began anew knows it too, by its address
    page.locator("#prompt", has_text="Continue as ann?").wait_for()
    page.locator("[data-participant=ann]", has_text=f"{KILLED_AFTER} of {TRIALS}").click()
    page.locator("#go", has_text="Continue").wait_for()
    sat.leaves.append(page.locator("#leave").is_visible())
    page.locator("#go", has_text="Continue").click()
    wait_until_asked(page)
    measure_on_a_phone(page, sat)
    page.keyboard.press("p")
    page.locator("#prompt", has_text="Paused").wait_for()
    page.keyboard.press("Space")
    wait_until_asked(page)
    page.keyboard.press("Escape")
    page.locator("#prompt", has_text="Stopped").wait_for()
    page.locator("#go", has_text="Continue").click()


def measure_on_a_phone(page: Any, sat: Sat) -> None:
    page.set_viewport_size({"width": 360, "height": 740})
    boxes = [button.bounding_box() for button in page.locator("button:visible").all()]
    sat.button_sides = [min(box["width"], box["height"]) for box in boxes if box]
    sat.phone_width = page.evaluate("() => document.documentElement.scrollWidth")
    page.mouse.wheel(0, 2000)
    stop = page.locator("#stop").bounding_box()
    sat.stop_in_view = 0 <= stop["y"] <= 740 - stop["height"]
    page.set_viewport_size({"width": 1280, "height": 800})


def test_all_trials_survive_a_kill_half_way(sat: Sat) -> None:
    answered_before = [event for event in sat.before if event["event"] == "answered"]
    answers = [event for event in sat.after if event["event"] == "answered"]
    design = json.loads((sat.folder / "study.json").read_text())
    assert len(answered_before) == KILLED_AFTER
    assert sat.before[-1]["event"] in ("presented", "played")
    assert sat.after[: len(sat.before)] == sat.before
    assert [event["trial"] for event in answers] == list(range(TRIALS))
    assert [event["pattern"] for event in answers] == design["trials"]["ann"]
    assert set(Counter(event["pattern"] for event in answers).values()) == {REPEATS}
    assert answers[KILLED_AFTER]["attempt"] == 4  # killed, paused, stopped, answered
    assert all(0.0 < event["reaction_s"] < 600.0 for event in answers)
    assert all(event["seen_ms"] >= 0.0 for event in answers)
    assert sum(event["pattern"] == event["answered"] for event in answers) == TRIALS * 4 // 5
    assert all(e["speaker_level"] > 0.0 for e in sat.after if e["event"] == "played")


def test_after_a_kill_the_page_offers_whoever_sat_here_first(sat: Sat) -> None:
    assert sat.offered == ["ann again", "ben "]
    assert sat.left_at == sat.address + "#ann"


def test_another_participant_is_chosen_only_before_a_sitting_and_after_it(sat: Sat) -> None:
    assert sat.leaves == [False, True]


def test_the_page_keeps_to_its_policy_and_asks_nobody_else(sat: Sat) -> None:
    assert sat.faults == []
    assert "default-src 'self'" in sat.policy
    assert all(url.startswith(sat.address) for url in sat.requests)


def test_the_page_never_learns_the_pattern_of_a_trial(sat: Sat) -> None:
    told = [json.loads(text) for text in sat.heard]
    shown = [view for view in told if view.get("phase") in ("asking", "playing")]
    assert len(shown) >= TRIALS
    assert all(view["feeling"] is None for view in shown)
    assert not any(name in json.dumps(_without_pattern_list(v)) for v in shown for name in NAMES)


def test_masking_noise_ends_with_the_last_trial_and_when_the_page_is_left(sat: Sat) -> None:
    assert [len(sat.noises[when]) for when in ("in a trial", "left")] == [1, 0]
    assert sat.noises["done"] == []


def test_the_page_fits_a_phone_with_the_stop_in_view(sat: Sat) -> None:
    assert min(sat.button_sides) >= 44
    assert sat.phone_width <= 360
    assert sat.stop_in_view


def _without_pattern_list(view: dict[str, Any]) -> dict[str, Any]:
    kept = ("phase", "answered", "trouble", "busy", "feeling", "next_to_feel", "participant")
    assert set(view) <= {*kept, *_PUBLIC}
    return {name: view[name] for name in kept}


_PUBLIC = {
    "minutes",
    "patterns",
    "participants",
    "devices",
    "masking_noise",
    "renderings_wanted",
    "trials",
    "renderings",
    "is_trained",
    "hear",
    "language",
    "questions",
    "to_rate",
    "seconds_left",
}

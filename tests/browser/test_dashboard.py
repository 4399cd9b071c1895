"""The dashboard in a real Chromium, against a real service on simulated devices."""

import os
import signal
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
from conftest import status
from dashboard_scene import (
    PATIENCE_MS,
    WATCH_POLICY,
    board_on_a_port,
    dashboard,
    idling,
    touching,
)
from playwright.sync_api import APIResponse, Browser, Page, Route, expect
from ports import free_port
from soak_dashboard import soak

from hapticvlm.client.local_service import Service, running
from hapticvlm.devices.simulated.simulated import SimulatedPlate
from hapticvlm.devices.simulated.simulated_board import SimulatedBoard

pytestmark = pytest.mark.browser

TOKEN = "s3cret"
SILENCE = 1e-4  # of full scale
SOAK_S = float(os.environ.get("HAPTICVLM_SOAK_S", "8"))
LEAK_MB = 2.0  # a heap that still fills grows by one, within SOAK_S


@dataclass
class Guarded:
    """A service that wants a token, with a board at the end of a serial line."""

    service: Service
    board: SimulatedBoard


@pytest.fixture(scope="module")
def guarded() -> Iterator[Guarded]:
    with (
        board_on_a_port() as (port, board),
        running(["--token", TOKEN, "--peltier", port]) as found,
    ):
        yield Guarded(found, board)


def until(page: Page, service: Service, claim: Any) -> None:
    """Poll the service's status until `claim` holds."""
    for _ in range(round(PATIENCE_MS / 50)):
        if claim(status(service)):
            return
        page.wait_for_timeout(50)
    pytest.fail(f"it never happened: {status(service)}")


def is_felt(found: dict[str, Any]) -> bool:
    level: float = found["speaker"]["level"]
    return level > SILENCE


def test_a_touched_object_is_shown_with_material_confidence_rung_and_why(
    service: Service, browser: Browser
) -> None:
    with dashboard(browser, service.page) as page, touching(service.url, only="kettle"):
        expect(page.locator("#object")).to_have_text("kettle")
        expect(page.locator("#material")).to_have_text("metal")
        expect(page.locator("#verdict")).to_contain_text("stated by the scene")
        source = page.locator("#rungs tr.source")
        expect(source.locator("th")).to_have_text("scene")
        assert float(source.locator("meter").get_attribute("value") or 0) > 0.9
        because = page.locator("#because")
        expect(because).to_contain_text("21.0 °C (21.0 to 21.0), from the scene")
        expect(because).to_contain_text("12.0 °C (12.0 to 12.0), from the scene")
        expect(page.locator("#service")).to_contain_text("test scene")
        expect(page.locator("#news")).to_contain_text("kettle is metal, by scene")


@pytest.mark.nightly
def test_a_chosen_object_stays_explained_while_others_are_decided(
    service: Service, browser: Browser
) -> None:
    with dashboard(browser, service.page) as page, touching(service.url):
        page.get_by_role("button", name="kettle").click()
        expect(page.get_by_role("button", name="GlassPane")).to_be_visible()
        expect(page.locator("#object")).to_have_text("kettle")
        page.get_by_role("button", name="Follow the newest").click()
        expect(page.locator("#object")).not_to_have_text("kettle")


@pytest.mark.parametrize("press", ["click", "Escape"])
def test_the_stop_silences_a_hand_that_rubs_on_until_it_lets_go_and_touches_anew(
    service: Service, browser: Browser, press: str
) -> None:
    with dashboard(browser, service.page) as page:
        with touching(service.url, only="table", lets_go=False):
            until(page, service, lambda found: is_felt(found) and found["leases"] == 1)
            if press == "click":
                page.click("#stop")
            else:
                page.keyboard.press(press)
            held = {hand: ["speaker", "peltier"] for hand in ("left", "right")}
            until(page, service, lambda found: found["held"] == held)
            until(page, service, lambda found: not is_felt(found))
            page.wait_for_timeout(500)
            stopped = status(service)
            assert not is_felt(stopped)
            assert stopped["leases"] == 0
            expect(page.locator("#stopped")).to_contain_text("Release and touch again")
        with touching(service.url, only="table"):
            expect(page.locator("#stopped")).to_be_empty()
            still = "left hand: speaker, peltier"
            expect(page.locator("#service")).to_contain_text(still)


@pytest.mark.nightly
def test_the_last_frame_is_drawn_with_its_region(service: Service, browser: Browser) -> None:
    with dashboard(browser, service.page) as page, touching(service.url):
        page.get_by_role("button", name="Object_07").click()
        expect(page.locator("#frame-said")).to_contain_text("Object_07; the box is the region")
        edge = page.evaluate(
            """() => {
              const canvas = document.getElementById("frame");
              const side = canvas.width;
              const at = (x, y) => [...canvas.getContext("2d").getImageData(x, y, 1, 1).data];
              return [side, at(side / 4, side / 2), at((3 * side) / 4, side / 2)];
            }"""
        )
    assert edge[0] == 224
    assert edge[1:] == [[255, 255, 255, 255]] * 2


@pytest.mark.nightly
def test_stage_times_drops_and_the_log_are_shown(service: Service, browser: Browser) -> None:
    with dashboard(browser, service.page) as page, touching(service.url):
        for stage in (
            "touch to first sample",
            "queue",
            "decode",
            "encode",
            "match",
            "whole recognition",
        ):
            row = page.locator("#stages tr").filter(has_text=stage)
            expect(row.locator("td").nth(1)).to_contain_text("ms")
        expect(page.locator("#counts")).to_contain_text("audio underruns")
        expect(page.locator("#log")).to_contain_text("'test scene'")
        expect(page.locator("#log")).to_contain_text("connected as scene, owner: True")


def test_a_token_is_asked_for_and_a_wrong_one_refused(guarded: Guarded, browser: Browser) -> None:
    page = browser.new_page()
    page.goto(guarded.service.page)
    for token, place, answer in (
        ("wrong", "#gone", "The token is wrong"),
        (TOKEN, "#link", "Connected to hapticvlm"),
    ):
        page.get_by_label("Token of this service").fill(token)
        page.get_by_role("button", name="Connect").click()
        expect(page.locator(place)).to_contain_text(answer, timeout=PATIENCE_MS)
    expect(page.locator("#token-form")).to_be_hidden()
    page.close()


def test_a_fault_of_the_plate_is_said_with_what_to_do(guarded: Guarded, browser: Browser) -> None:
    with dashboard(browser, f"{guarded.service.page}#token={TOKEN}") as page:
        expect(page.locator("#faults")).to_contain_text("no fault")
        guarded.board.plate = SimulatedPlate(stuck_sensor_c=44.0)
        fault = page.locator("#faults .fault")
        expect(fault).to_contain_text("The plate is off: the plate reached 41 degC")
        expect(fault.locator(".cure")).to_contain_text("Remedy: take the hand off")
        expect(page.locator("#troubles")).to_contain_text("plate fault")
        assert violations_of(page) == []


def test_a_killed_service_is_said_and_a_new_one_is_taken_up(browser: Browser) -> None:
    address = ["--port", str(free_port())]
    with running(address) as service, dashboard(browser, service.page) as page:
        service.process.kill()
        expect(page.locator("#gone")).to_contain_text("Service unreachable since")
        expect(page.locator("#plate")).to_have_text("no reading")
        expect(page.locator("#faults")).to_contain_text("Unknown")
        page.click("#stop")
        expect(page.locator("#stopped")).to_contain_text("NOT STOPPED: no connection")
        service.process.wait()
        with running(address) as again, touching(again.url, only="kettle"):
            expect(page.locator("#link")).to_contain_text("Connected to hapticvlm")
            expect(page.locator("#plate")).to_contain_text("°C")
            expect(page.locator("#material")).to_have_text("metal")


@pytest.mark.skipif(not hasattr(signal, "SIGSTOP"), reason="needs a signal that halts")
def test_a_service_that_hangs_is_said_and_so_is_a_stop_without_answer(
    service: Service, browser: Browser
) -> None:
    with dashboard(browser, service.page) as page:
        service.process.send_signal(signal.SIGSTOP)
        try:
            expect(page.locator("#gone")).to_contain_text("has sent nothing since")
            page.click("#stop")
            expect(page.locator("#stopped")).to_contain_text("NOT CONFIRMED")
        finally:
            service.process.send_signal(signal.SIGCONT)
        expect(page.locator("#link")).to_contain_text("Connected")


@pytest.mark.nightly
def test_an_owner_that_touches_nothing_for_long_is_ended_by_a_button(
    service: Service, browser: Browser
) -> None:
    def older(route: Route) -> None:
        found = route.fetch().json()
        if found["owner"]:
            found["owner_idle_s"] += 31.0  # nobody waits for it here
        route.fulfill(json=found)

    with dashboard(browser, service.page) as page, idling(service.url):
        until(page, service, lambda found: found["owner"] is not None)
        expect(page.locator("#owner")).to_contain_text("Owner: idle scene")
        expect(page.locator("#end-owner")).to_be_hidden()
        page.route("**/status", older)
        expect(page.locator("#owner")).to_contain_text("idle for 3")
        page.get_by_role("button", name="End owner").click()
        until(page, service, lambda found: found["owner"] is None)
        until(page, service, lambda found: found["counts"].get("owners ended") == 1)
        expect(page.locator("#end-owner")).to_be_hidden()


def test_a_missing_reading_is_never_shown_as_a_number(service: Service, browser: Browser) -> None:
    with dashboard(browser, service.page) as page:
        shown = page.evaluate(
            """async () => {
              const plate = await import("./plate.js");
              const readings = { plate_c: null, setpoint_c: 32, sink_c: null, duty: 0 };
              plate.telemetry(readings);
              return ["plate", "sink"].map((id) => document.getElementById(id).textContent);
            }"""
        )
    assert shown == ["no reading", "no reading"]


@pytest.fixture(scope="module")
def modules(service: Service, browser: Browser) -> Iterator[Page]:
    """A page that may import the dashboard's modules and draws nothing."""
    page = browser.new_page()
    page.goto(f"{service.page}ring.js")
    yield page
    page.close()


def test_the_spectrum_shows_a_tone_at_its_frequency_and_amplitude(modules: Page) -> None:
    amplitudes, strongest = modules.evaluate(
        """async () => {
          const { spectrum, strongestHz } = await import("./spectrum.js");
          const tone = (n) => 0.3 * Math.sin((2 * Math.PI * 250 * n) / 3000);
          const found = spectrum(Array.from({ length: 300 }, (_, n) => tone(n)), 3000);
          return [[...found], strongestHz(found)];
        }"""
    )
    assert strongest == 250
    assert amplitudes[25] == pytest.approx(0.3, abs=1e-6)
    assert max(amplitudes[:23] + amplitudes[28:]) < 1e-6


def test_the_ring_keeps_the_newest_and_quantiles_are_numpys(modules: Page) -> None:
    values = np.random.default_rng(1).normal(size=150).tolist()
    found = modules.evaluate(
        """async (values) => {
          const { Ring, quantile } = await import("./ring.js");
          const ring = new Ring(100, 1);
          for (const value of values) ring.push(value);
          ring.push(null);
          const sorted = ring.sorted(0);
          const shares = [0.5, 0.99].map((share) => quantile(sorted, share));
          return [sorted.length, ...shares, quantile([], 0.5)];
        }""",
        values,
    )
    kept = values[51:]
    assert found == [
        99,
        pytest.approx(np.median(kept)),
        pytest.approx(np.quantile(kept, 0.99)),
        None,
    ]


@pytest.mark.nightly
def test_the_theme_follows_the_system_and_a_choice_is_kept(
    service: Service, browser: Browser
) -> None:
    ground = "getComputedStyle(document.body).backgroundColor"
    light, dark = "rgb(239, 242, 244)", "rgb(15, 20, 24)"
    with dashboard(browser, service.page, color_scheme="dark") as page:
        assert page.evaluate(ground) == dark
        page.get_by_label("Theme").select_option("light")
        assert page.evaluate(ground) == light
        page.reload()
        assert page.evaluate(ground) == light


def test_the_keyboard_reaches_the_stop_first_and_sees_where_it_is(
    service: Service, browser: Browser
) -> None:
    with dashboard(browser, service.page) as page:
        page.keyboard.press("Tab")
        focused = "document.activeElement.id"
        assert page.evaluate(focused) == "stop"
        assert page.evaluate("getComputedStyle(document.activeElement).outlineWidth") == "3px"
        page.keyboard.press("Enter")
        expect(page.locator("#stopped")).to_contain_text("Stopped at")


def test_a_status_from_before_a_stop_does_not_wipe_that_it_was_confirmed(
    service: Service, browser: Browser
) -> None:
    holds_on = touching(service.url, only="table", lets_go=False)
    with dashboard(browser, service.page) as page, holds_on:
        late: list[tuple[Route, APIResponse]] = []

        def delay_the_first(route: Route) -> None:
            if late:
                route.continue_()
            else:
                late.append((route, route.fetch()))

        page.route("**/status", delay_the_first)
        while not late:
            page.wait_for_timeout(50)
        page.click("#stop")
        expect(page.locator("#stopped")).to_contain_text("Stopped at")
        route, before = late[0]
        with page.expect_response("**/status"):
            route.fulfill(response=before)
        page.wait_for_timeout(200)
        assert "Stopped at" in page.inner_text("#stopped")


def test_nothing_is_asked_of_anybody_else_and_no_policy_is_broken(
    service: Service, browser: Browser
) -> None:
    asked: list[str] = []
    complaints: list[str] = []
    context = browser.new_context()
    page = context.new_page()
    page.add_init_script(WATCH_POLICY)
    page.on("request", lambda request: asked.append(request.url))
    page.on("websocket", lambda found: asked.append(found.url.replace("ws://", "http://")))
    page.on("console", lambda line: complaints.append(line.text))
    page.on("pageerror", lambda error: complaints.append(str(error)))
    page.goto(service.page)
    with touching(service.url):
        expect(page.locator("#stages")).to_contain_text("whole recognition")
        page.get_by_role("button", name="Object_07").click()
        expect(page.locator("#frame-said")).to_contain_text("the box is the region")
    assert {url for url in asked if not url.startswith(service.page)} == set()
    assert len(asked) > 10
    assert complaints == []
    assert violations_of(page) == []
    context.close()


@pytest.mark.nightly
def test_memory_stays_flat_and_every_interaction_is_painted(
    service: Service, browser: Browser
) -> None:
    with touching(service.url):
        found = soak(browser, service.page, SOAK_S)
    print(found)
    assert found["telemetry_hz"] > 1.0
    assert found["interactions"] >= 3
    assert found["growth_mb"] < LEAK_MB
    assert found["node_growth"] < 200
    assert found["median_ms"] < 1000.0
    assert found["frames"] > 20


def violations_of(page: Page) -> list[str]:
    found: list[str] = page.evaluate("violations")
    return found

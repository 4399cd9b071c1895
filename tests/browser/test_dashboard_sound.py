"""The vibration as the dashboard plays it: each material's own sound, and silence after a stop."""

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from dashboard_scene import dashboard
from playwright.sync_api import Browser, Page, expect

from hapticvlm.client.local_service import Service
from hapticvlm.materials import MATERIALS
from hapticvlm.rendering.vibration.sound_voice import as_sound
from hapticvlm.rendering.vibration.vibration import RATE_HZ, Motion
from hapticvlm.touches.sound import sound

pytestmark = [pytest.mark.browser, pytest.mark.realtime]

STRIKE = Motion(0.6, 4.0)  # the dashboard's own, pages/trial.js
HOLD_MS = 1500
SILENT = 2e-3  # of full scale
SILENCE_S = 0.1
# Everything that leaves the page's gain, with the audio clock's time of each block.
RECORD = """async () => {
  const { sound } = await import("./hear.js");
  const context = sound.output.context;
  const node = context.createScriptProcessor(512, 1, 1);
  window.blocks = [];
  node.onaudioprocess = (event) =>
    blocks.push({ at: event.playbackTime, samples: [...event.inputBuffer.getChannelData(0)] });
  sound.output.connect(node);
  node.connect(context.destination);
  window.recorder = node;
  addEventListener("keydown", () => (window.stoppedAt ??= context.currentTime), { capture: true });
  return context.sampleRate;
}"""

SOUNDS = "() => blocks.some(({samples}) => samples.some((value) => Math.abs(value) > 1e-3))"


@pytest.fixture
def listening(service: Service, browser: Browser) -> Iterator[tuple[Page, int]]:
    """A dashboard whose sound is on and recorded, and the samples a second of it."""
    with dashboard(browser, service.page, (1280, 800)) as page:
        page.locator("#hear").click()
        expect(page.locator("#hear")).to_have_text("Sound on")
        yield page, page.evaluate(RECORD)


def hold(page: Page, interaction: str) -> None:
    """Press a test touch and keep it pressed."""
    page.locator(f'[data-interaction="{interaction}"]').hover()
    page.mouse.down()


def recorded(page: Page) -> np.ndarray:
    blocks: list[dict[str, Any]] = page.evaluate("blocks.splice(0)")
    return np.concatenate([block["samples"] for block in blocks])


def spectrum(wave: np.ndarray, rate_hz: int = RATE_HZ, highest_hz: int = 1000) -> np.ndarray:
    """Levels of bands of 20 Hz from 40 to `highest_hz`, dB, of what follows the onset."""
    onset = int(np.argmax(np.abs(wave) > 0.25 * np.abs(wave).max()))
    part = wave[onset : onset + round(0.12 * rate_hz)]
    power = np.abs(np.fft.rfft(part, rate_hz)) ** 2  # bins of 1 Hz
    bands = power[40:highest_hz].reshape(-1, 20).sum(axis=1)
    return np.asarray(10.0 * np.log10(bands / bands.max() + 1e-4))


@pytest.mark.nightly
@pytest.mark.parametrize(("voice", "highest_hz"), [("true", 1000), ("sound", 4000)])
def test_what_is_heard_of_a_strike_is_glass_for_glass_and_wood_for_wood(
    listening: tuple[Page, int], voice: str, highest_hz: int
) -> None:
    page, rate_hz = listening
    page.locator("#hear-voice").select_option(voice)
    own = {name: spectrum(played(voice, name), highest_hz=highest_hz) for name in ("glass", "wood")}
    for name in own:
        page.locator("#trial-material").select_option(name)
        recorded(page)
        for _ in range(30):  # one that comes too late on a busy machine is not played
            hold(page, "strike")
            page.wait_for_timeout(HOLD_MS)
            page.mouse.up()
            if page.evaluate(SOUNDS):
                break
        page.wait_for_timeout(HOLD_MS)
        heard = spectrum(recorded(page), rate_hz, highest_hz)
        alike = {other: float(np.corrcoef(heard, shape)[0, 1]) for other, shape in own.items()}
        print(f"{name} heard, {voice}: correlation of spectra {alike}")
        assert max(alike, key=lambda other: alike[other]) == name
        assert alike[name] > 0.7


def played(voice: str, material: str) -> np.ndarray:
    """The dashboard's strike of this material in this voice, (N,) at RATE_HZ."""
    wave = sound(MATERIALS[material], "strike", STRIKE, 0.4).wave
    return wave if voice == "true" else as_sound(wave)


def test_nothing_is_heard_a_tenth_of_a_second_after_a_stop(listening: tuple[Page, int]) -> None:
    page, _ = listening
    page.locator("#trial-material").select_option("fabric")
    hold(page, "slide")
    page.wait_for_timeout(HOLD_MS)
    page.keyboard.press("Escape")
    page.wait_for_timeout(HOLD_MS)
    page.mouse.up()
    stopped_at = page.evaluate("stoppedAt")
    blocks: list[dict[str, Any]] = page.evaluate("blocks")
    loud = [block["at"] for block in blocks if np.abs(block["samples"]).max() > SILENT]
    assert loud, "the stroke was not heard at all"
    assert min(loud) < stopped_at
    print(f"silent {1000 * (max(loud) - stopped_at):.0f} ms after the key")
    assert max(loud) - stopped_at < SILENCE_S


def test_a_stop_while_sound_begins_leaves_it_off(service: Service, browser: Browser) -> None:
    with dashboard(browser, service.page, (1280, 800)) as page:
        assert page.evaluate("""async () => {
          const { Sound } = await import("./sound.js");
          const sound = new Sound();
          const begun = sound.start();
          sound.stop();
          await begun;
          return [sound.isOn, sound.output];
        }""") == [False, None]


@pytest.mark.nightly
def test_sound_that_could_not_begin_begins_at_the_next_click(
    service: Service, browser: Browser
) -> None:
    with dashboard(browser, service.page, (1280, 800)) as page:
        page.evaluate("""() => {
          const { addModule } = AudioWorklet.prototype;
          AudioWorklet.prototype.addModule = function () {
            AudioWorklet.prototype.addModule = addModule;
            throw new Error("the network is gone");
          };
        }""")
        page.locator("#hear").click()
        expect(page.locator("#hear-lag")).to_have_text("no sound: the network is gone")
        page.locator("#hear").click()
        expect(page.locator("#hear")).to_have_text("Sound on")

"""The sound of a bake in a real browser: touches go to an AudioWorklet and are heard."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from static_server import served

pytestmark = [pytest.mark.nightly, pytest.mark.browser]
CLIENT = Path(__file__).parents[2] / "examples" / "webxr" / "client"
# An offline context is suspended while touches are sent, so that their times do not depend on the
# machine. It goes on when another processor of the same thread has answered: by then the touch,
# which was sent before, is received.
RENDER = """async () => {
  const {openFeel} = await import('/feel.js');
  const {FeltSound} = await import('/sound.js');
  const feel = openFeel(await (await fetch('/feel.sound.json')).json());
  const context = new OfflineAudioContext(1, 24000, 24000);
  const echo = `registerProcessor('echo', class extends AudioWorkletProcessor {
    constructor() { super(); this.port.onmessage = ({data}) => this.port.postMessage(data); }
    process() { return true; }
  });`;
  const code = new Blob([echo], {type: 'text/javascript'});
  await context.audioWorklet.addModule(URL.createObjectURL(code));
  const {port} = new AudioWorkletNode(context, 'echo');
  const sound = await FeltSound.open(context, feel);
  sound.output.connect(context.destination);
  const touch = {phase: 'contact', hand: 'right', speed_mps: 0.8, force_n: 2};
  const at = async (time, act) => {
    await context.suspend(time);
    act();
    await new Promise((received) => { port.onmessage = received; port.postMessage(0); });
    context.resume();
  };
  at(0.256, () => sound.touch(touch, {material: 'glass'}));
  at(0.512, () => sound.stop());
  const wave = (await context.startRendering()).getChannelData(0);
  const peak = (from, to) => Math.max(...wave.subarray(from * 24000, to * 24000).map(Math.abs));
  return {before: peak(0, 0.25), struck: peak(0.256, 0.3), after: peak(0.56, 1)};
}"""


@pytest.fixture
def page(browser: Any) -> Iterator[Any]:
    with served(CLIENT) as address:
        page = browser.new_page()
        page.goto(address)
        yield page
        page.close()


def test_a_strike_is_heard_when_it_is_sent_and_nothing_after_a_stop(page: Any) -> None:
    peaks = page.evaluate(RENDER)
    assert peaks["before"] == 0
    assert peaks["struck"] > 0.3
    assert peaks["after"] == 0

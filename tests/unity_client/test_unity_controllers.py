"""Controllers that play the `vibration` event, against the real service and a scripted one.

The scripted service sends plans, then an empty one, then plans again, and then hangs: the cases in
which a client must fall silent. Both processes read the same monotonic clock.
"""

import json
import re
import threading
import time
from pathlib import Path

import msgpack
import pytest
from websockets.exceptions import ConnectionClosed
from websockets.sync.server import serve

pytest_plugins = ("mono_build",)
ANSWERS = Path(__file__).parents[2] / "schemas" / "vectors" / "answers.json"
PLAN = {"type": "vibration", "id": 0, "hand": "right", "period_ms": 14.0, "amplitude": [0.8] * 7}
EMPTY = {"type": "vibration", "id": 0, "hand": "right", "period_ms": 14.0, "stopped": True}


def welcome(*, simulated):
    answers = {case["name"]: case["msgpack"] for case in json.loads(ANSWERS.read_text())}
    message = msgpack.unpackb(bytes.fromhex(answers["welcome"]))
    message["owner"] = True
    message["devices"]["speaker"] = {"name": "palm", "simulated": simulated}
    return message


class Script:
    """A link that hangs and is lost, then one with a stop; `lost` and `stopped` are the times."""

    def __init__(self, *, simulated=True):
        self.welcome = welcome(simulated=simulated)
        self.lost = self.stopped = None
        self.feel = []

    def __call__(self, link):
        try:
            self.greet(link)
            self.play(link)
            if self.lost is None:
                self.lost = time.monotonic()
            elif self.stopped is None:
                link.send(msgpack.packb(EMPTY))
                self.stopped = time.monotonic()
            time.sleep(0.5)  # a lost link hangs, it does not close
            link.socket.close()
        except ConnectionClosed:
            return

    def greet(self, link):
        hello = msgpack.unpackb(link.recv())
        link.send(msgpack.packb({**self.welcome, "id": hello["id"]}))
        while not self.feel:
            message = msgpack.unpackb(link.recv())
            link.send(msgpack.packb({"type": "ok", "id": message["id"]}))
            if message.get("feel"):
                self.feel.append(message["feel"])

    @staticmethod
    def play(link):
        for _ in range(15):
            link.send(msgpack.packb(PLAN))
            time.sleep(0.033)


def run(build, script, *, silent_with_speaker=False):
    with serve(script, "127.0.0.1", 0) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        url = f"ws://127.0.0.1:{server.socket.getsockname()[1]}/"
        output = build.run("components.exe", "Hands.Run", url, str(silent_with_speaker))
        server.shutdown()
    return output


def times(output, word):
    return [float(found) for found in re.findall(rf"^{word} ([\d.]+)$", output, re.MULTILINE)]


@pytest.fixture(scope="module")
def played(build):
    script = Script()
    return script, run(build, script)


def test_a_controller_plays_what_the_service_plans_times_its_gain(played):
    script, output = played
    assert script.feel == [{"right": "amplitude"}]
    assert "most 0.400 left False" in output
    assert len(times(output, "on")) >= 2


@pytest.mark.realtime
def test_a_controller_is_silent_50_ms_after_a_stop_and_stays_so(played, capsys):
    script, output = played
    silent = times(output, "off")[-1]
    with capsys.disabled():
        print(f"\nsilent {1e3 * (silent - script.stopped):.0f} ms after the stop")
    assert -0.05 < silent - script.stopped < 0.05


@pytest.mark.realtime
def test_a_controller_is_silent_100_ms_after_the_link_is_lost(played, capsys):
    script, output = played
    silent = min(each for each in times(output, "off") if each > script.lost - 0.15)
    with capsys.disabled():
        print(f"\nsilent {1e3 * (silent - script.lost):.0f} ms after the loss")
    assert silent - script.lost < 0.1


def test_a_controller_vibrates_also_while_the_service_plays_on_a_real_speaker(build):
    output = run(build, Script(simulated=False))
    assert "most 0.400" in output
    assert "silent because \n" in output


def test_a_controller_rests_beside_a_palm_speaker_where_told_and_says_why(build):
    output = run(build, Script(simulated=False), silent_with_speaker=True)
    assert "most 0.000" in output
    assert "pulses 0" in output
    assert "silent because the service plays on the speaker 'palm'" in output
    assert "untick it" in output


def test_a_plan_without_a_link_is_not_felt_and_a_stop_is(build):
    assert "plans 0 stops 1" in build.run("components.exe", "Hands.Early", "False")
    assert "plans 1 stops 1" in build.run("components.exe", "Hands.Early", "True")

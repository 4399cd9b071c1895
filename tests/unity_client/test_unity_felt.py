"""The switch between the service and the bake: on a clock of its own, and in the components."""

import os
import re
import signal
import subprocess
import time

import mono
import pytest
import switch_cases
from pace import PACE
from ports import free_port

from hapticvlm.client.local_service import running

pytest_plugins = ("mono_build",)
NOBODY = "ws://127.0.0.1:9/"
MOST_GAP_MS = 50.0


def test_the_switch_between_service_and_bake_does_as_the_scripts_say(build):
    output = build.run("components.exe", "FeltSwitch.Run", text=switch_cases.lines())
    told: dict[str, dict[str, str]] = {name: {} for name in switch_cases.CASES}
    for case, name, value in re.findall(r"^said\t(.+)\t(.+)\t(.*)$", output, re.MULTILINE):
        told[case][name] = value
    assert switch_cases.problems(told, "because") == []


def test_a_controller_is_felt_from_the_bake_until_a_service_answers_and_says_so(play):
    output = play("FeltRooms.Auto")
    for expected in (
        "without a service felt by Baked silence \n",
        "with a service felt by Service decided wood silence \n",
        "switched by hand plays on True connected False",
        "stopped 0 silence outputs stopped: release and touch again",
        "let go 0",
        "felt again exceptions 0 errors 0",
        "without a client 0",
    ):
        assert expected in output, output


def test_the_baked_mode_connects_to_nothing_and_names_what_has_no_material(play):
    output = play("FeltRooms.Baked", NOBODY)
    assert "silence 'Xyzzy' is not in the bake; there is no materials.json: choose" in output
    assert "amplitude 0 " in output
    assert "felt from the bake; nothing connects connected False threads 0" in output
    assert "effect True warnings 0 exceptions 0" in output


def test_a_bake_tells_what_the_scene_does_not_and_a_script_overrides_it(play):
    output = play("FeltRooms.BakedScene", NOBODY)
    assert "copy True stone" in output  # made at run time, with an id of its own
    assert "overridden, errors 0" in output
    assert "silence 'Xyzzx' is not in the bake; nearest is 'Xyzzy': choose" in output
    assert "looked up once True" in output  # though an inspector asks in each picture
    refused = [line for line in output.splitlines() if "materials.json: version 9" in line]
    assert len(refused) == 1  # once, not in each frame
    assert "bake it again" in refused[0]


def test_a_speaker_is_heard_while_the_bake_is_felt_and_silent_after_a_stop(play):
    output = play("FeltRooms.Speaker", NOBODY)
    for expected in (
        "heard Sound",
        "heard True",
        "gaps 0",
        "while the service is felt 0\n",
        "after a stop 0\n",
        "enabled after a stop 0\n",
        "without a client 0\n",
        "bytes of the audio thread 0 exceptions 0 errors 0",
    ):
        assert expected in output, output


@pytest.mark.nightly
def test_the_package_compiles_without_its_network_part(build):
    files = mono.sources(mono.PACKAGE / "Runtime" / "Unity")
    using = ("HapticVLM.Core.dll", "HapticVLM.Baked.dll", "UnityEngine.dll")
    defined = "-d:HAPTICVLM_NO_NETWORK"
    built = build.compile("offline/HapticVLM.Unity.dll", files, mono.QUIET, defined, using=using)
    assert b"HapticConnection" in built.read_bytes()  # types of its interface
    assert b"ConnectionSettings" not in built.read_bytes()  # nothing makes a connection


@pytest.mark.nightly
@pytest.mark.realtime
def test_a_stroke_goes_on_while_a_real_service_freezes_and_is_killed(build, capsys):
    port = free_port()
    command = ["mono", "--debug", str(build.folder / "components.exe"), "FeltRooms.Survive"]
    with subprocess.Popen(
        [*command, f"ws://127.0.0.1:{port}/"],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        env=os.environ | mono.RESOURCES,
    ) as scene:
        assert scene.stdout is not None
        for _ in range(3):
            with running(["--port", str(port)]) as service:
                assert "Service\n" in scene.stdout  # reads on until it is felt
                for _ in range(5):
                    service.process.send_signal(signal.SIGSTOP)
                    assert "Baked\n" in scene.stdout
                    time.sleep(0.5)
                    service.process.send_signal(signal.SIGCONT)
                    assert "Service\n" in scene.stdout
                service.process.kill()
            assert "Baked\n" in scene.stdout
        output, _ = scene.communicate("", timeout=60.0 * PACE)
    with capsys.disabled():
        print("\n" + output.strip())
    found = dict(re.findall(r"(gap_ms|longest_frame_ms|baked) (\d+)", output))
    assert int(found["baked"]) > 15 * 0.3 * 72
    # A frame that the machine delays leaves a gap of its own.
    assert int(found["gap_ms"]) <= MOST_GAP_MS + max(0.0, int(found["longest_frame_ms"]) - 14)
    assert "exceptions 0" in output

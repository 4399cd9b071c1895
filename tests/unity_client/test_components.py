"""The package's components in an executable stand-in of the engine, against the real service.

The stand-in (stubs/) calls the components as the engine does, returns pictures late, simulates a
lost device, counts live objects, and measures the cost of the package's code on the main thread.
"""

import re

import mono
import pytest
from mono import figure

from hapticvlm.client.local_service import running

pytest_plugins = ("mono_build",)
MAIN_LOOP_MS = 2.0


def test_the_package_compiles_for_2022_3_and_later(build):
    files = mono.sources(mono.PACKAGE / "Runtime" / "Unity")
    using = ("HapticVLM.Core.dll", "HapticVLM.Baked.dll", "UnityEngine.dll")
    defined = "-d:UNITY_2022_3_OR_NEWER"
    build.compile("newer/HapticVLM.Unity.dll", files, mono.QUIET, defined, using=using)


def test_a_hand_approaches_touches_changes_target_and_lets_go(play):
    output = play("Components.Touching")
    for expected in (
        "approach decides wood by Name",
        "touches True",
        "then glass by Scene",
        "back to the first True",  # the other object was destroyed under the hand
        "let go True",
        "refused 0",
        "paused Closed",
        "resumed Ready warnings 0",
    ):
        assert expected in output, output
    assert figure(output, "longest_ms") < 10.0 * MAIN_LOOP_MS


def test_parents_and_materials_that_say_nothing_leave_an_object_its_name(play):
    output = play("Components.Hierarchy")
    assert "Magazine is metal by Name" in output
    assert "WoodenChest is wood by Name" in output
    assert "Vase is metal by Name" in output


@pytest.mark.nightly
def test_streaming_allocates_nothing_on_the_main_thread_and_survives_a_lost_device(play, capsys):
    output = play("Components.Streaming")
    with capsys.disabled():
        print("\n" + next(line for line in output.splitlines() if line.startswith("frames")))
    assert "sent while lost 0" in output
    assert figure(output, "in_flight") == 1
    assert figure(output, "exceptions") == 0
    assert figure(output, "allocated") == 0
    assert figure(output, "pictures") > 10
    assert figure(output, "longest_ms") < 10.0 * MAIN_LOOP_MS
    assert "left arrays 0 textures 0" in output


@pytest.mark.nightly
def test_100_enable_cycles_and_a_reload_leave_nothing_behind(play):
    output = play("Components.Cycles")
    assert "works after 100 cycles" in output
    assert "left arrays 0 textures 0" in output
    assert figure(output, "exceptions") == 0


def test_only_objects_without_a_sure_material_are_scanned(play):
    output = play("Components.Scanning")
    assert "named wood" in output
    assert figure(output, "sent") >= 4  # one view of the named object, three of the unnamed one
    assert "unsure_layer 5" in output
    assert "stated not shown" in output
    assert "on demand warnings 0 exceptions 0" in output
    assert "left arrays 0 textures 0" in output


def test_the_editor_window_shows_decisions_and_the_plate_and_stops(play):
    with running() as stoppable:  # a stop holds until the hand lets go, here in no scene
        output = play("EditorParts.Show", stoppable.url)
    assert "Connection: up" in output
    assert re.search(r"Plate: [\d.]+ degC \(simulated\), setpoint", output)
    assert "OakPlanks: wood" in output
    assert "Warning: Player Settings > Run In Background" in output
    assert "stopped; repainted True" in output
    assert "threads left after reload 0" in output


def test_the_sample_that_asks_for_an_address_links_to_what_is_typed_and_remembers_it(
    play, build, service
):
    output = play("Components.TypeAddress", service.url, str(build.folder / "samples.dll"))
    assert "linked and remembered True typed-token" in output


@pytest.mark.nightly
def test_the_sample_of_object_ids_logs_what_is_felt(play, build, service):
    output = play("Components.Sample", service.url, str(build.folder / "samples.dll"))
    assert "OakTable feels like wood, by Name" in output

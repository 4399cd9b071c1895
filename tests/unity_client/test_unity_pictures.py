"""The pictures the package sends, on both kinds of graphics API, in the stand-in of the engine."""

import re

import mono

pytest_plugins = ("mono_build",)


def test_a_picture_is_upright_and_its_region_in_place_on_every_graphics_api(play):
    output = play("Pictures.Marker")
    for starts_at_top in ("False", "True"):
        expected = f"uv_top {starts_at_top} origin Top red_at_its_region True"
        assert expected in output, output
    assert "hdr False msaa False occlusion False shadows Disable after All" in output


def test_a_scan_uses_a_free_layer_and_changes_no_layer_of_the_scene(play):
    output = play("Pictures.Layers")
    assert "layers_changed 0" in output
    assert f"mask {1 << 29}" in output  # layer 30 has a name, 31 is the editor's
    # batched and skinned meshes, no particles
    assert "submesh True drawn 2 far True exceptions 0" in output


def test_a_picture_with_nothing_on_it_is_not_sent(play):
    output = play("Pictures.Empty")
    assert re.search(r"without alpha sent [3-9] empty 0", output)
    assert "hidden sent 0 empty 3" in output


def test_memory_is_freed_after_play_mode_ended_with_a_picture_on_the_gpu(play):
    output = play("Pictures.Retire")
    assert "left textures 0 errors 0 exceptions 0" in output


def test_no_name_of_a_test_program_ships():
    for source in mono.PACKAGE.rglob("AssemblyInfo.cs"):
        assert set(re.findall(r'InternalsVisibleTo\("(.+?)"\)', source.read_text())) <= {
            "HapticVLM.Tests.Editor",
            "HapticVLM.Tests.Runtime",
            "HapticVLM.Unity",
            "HapticVLM.Editor",
        }

"""The surfaces of one object in the stand-in of the engine, against the real service."""

import re

import pytest
from room_of_surfaces import ROOM

pytest_plugins = ("mono_build",)
NOBODY = "ws://127.0.0.1:9/"
LAST = len(ROOM) - 1


def felt(output):
    """Return what was felt as [(panel, surface, material)]."""
    lines = re.findall(r"^felt (\S+) surface (\d+) material (\S+)", output, re.MULTILINE)
    return [(name, int(surface), material) for name, surface, material in lines]


def test_each_surface_of_a_room_of_one_mesh_and_20_materials_is_felt_as_what_it_is(play):
    output = play("SurfaceRooms.Kept")
    largest_first = [(name, LAST - i, ROOM[name]) for i, name in enumerate(ROOM)]
    assert felt(output) == largest_first
    assert "warnings 0 errors 0 exceptions 0" in output


def test_rays_find_the_surface_of_a_mesh_collider_whose_mesh_is_not_readable(play):
    output = play("SurfaceRooms.ByRays")
    assert felt(output) == [(name, i, ROOM[name]) for i, name in enumerate(ROOM)]
    assert "warnings 0 errors 0 exceptions 0" in output


@pytest.mark.nightly
def test_the_largest_surface_is_felt_and_a_warning_says_so_where_none_can_be_found(play):
    output = play("SurfaceRooms.Unreadable")
    assert felt(output) == [("Oak_Planks", 0, "wood")]  # the first, where the sizes are not known
    assert "warnings 1 errors 0 exceptions 0" in output


@pytest.mark.nightly
def test_a_hand_that_slides_to_another_surface_of_one_object_feels_it(play):
    assert "slid over wood 19, metal 18, fabric 17, glass 16, stone 15" in play(
        "SurfaceRooms.SlidOver"
    )


def test_lower_levels_of_detail_hidden_renderers_and_other_objects_are_no_surfaces(play):
    output = play("SurfaceRooms.Levels", NOBODY)
    assert "surfaces 20 first Walnut gold False felt True" in output


@pytest.mark.nightly
@pytest.mark.realtime
def test_a_touch_finds_its_surface_among_10_000_triangles_in_less_than_0_1_ms(build, capsys):
    output = build.run("programs.exe", "surfaces", "10000")
    with capsys.disabled():
        print("\n" + output.strip())
    figures = dict(zip(output.split()[::2], map(float, output.split()[1::2]), strict=True))
    assert figures["triangles"] >= 10_000
    assert figures["first_half"] == pytest.approx(0.5, abs=0.05)
    assert figures["median_ms"] < 0.1

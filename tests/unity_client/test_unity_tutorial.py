"""The steps of docs/tutorials/unity.md, read from the page and followed in the stand-in engine."""

import re
import shutil

import mono
import pytest

from hapticvlm.client.local_service import running

pytest_plugins = ("mono_build",)
PAGE = mono.PACKAGE.parent / "docs" / "tutorials" / "unity.md"
CAMERA = "camera at 0.00 1.00 -10.00"
UNITY = ("HapticVLM.Core.dll", "HapticVLM.Baked.dll", "UnityEngine.dll", "Packages.dll")


def steps(name=None):
    """Return what the page tells to do in the editor, one action a line, up to Play."""
    lines = []
    for step in re.findall(r"^\d+\. (.*)$", PAGE.read_text(), re.MULTILINE):
        entries = re.findall(r"\*(GameObject > [^*]+)\*", step)
        lines += ["menu\t" + path.replace(" > ", "/") for path in entries]
        lines += [f"name\t{name or named}" for named in re.findall(r"Name it `(\w+)`", step)]
        if "Press Play" in step:
            return "\n".join([*lines, "play"]) + "\n"
    pytest.fail("the tutorial never says Press Play")


def follow(build, text):
    with running() as service:
        return build.run("components.exe", "Tutorial.Follow", service.url, text=text)


def with_input(build, folder, *flags):
    """Return a build whose package was compiled for a project with this input handling."""
    shutil.copytree(build.folder, folder, dirs_exist_ok=True)
    other = mono.Build(folder)
    name, folders, using = mono.OPTIONAL[0]
    other.compile(name, mono.sources(*folders), mono.QUIET, using=using)
    sources = mono.sources(mono.PACKAGE / "Runtime" / "Unity")
    other.compile("HapticVLM.Unity.dll", sources, mono.QUIET, *flags, using=UNITY)
    return other


def check_felt(output, shown):
    assert "hovers at 0.00 0.00 -0.60" in output, output
    assert "touches at 0.00 0.00 -0.50" in output, output
    assert f"| {shown}, rubbed at" in output, output
    assert CAMERA in output, output
    assert "exceptions 0" in output
    assert "threads left 0" in output


def test_the_steps_of_the_tutorial_let_the_cube_be_felt_and_leave_the_camera_where_it_is(build):
    shown = re.findall(r"`(OakTable: [^`]+)`", PAGE.read_text())[0]
    check_felt(follow(build, steps()), shown)
    assert shown in (mono.PACKAGE / "README.md").read_text()


def test_renamed_as_the_tutorial_says_the_cube_is_metal(build):
    renamed = re.findall(r"rename the cube `(\w+)`", PAGE.read_text())[0]
    check_felt(follow(build, steps(renamed)), f"{renamed}: metal, by Name")


def test_the_tutorial_works_in_a_project_that_has_only_the_input_system_package(build, tmp_path):
    other = with_input(build, tmp_path / "new", mono.INPUT_SYSTEM, mono.INPUT_PACKAGE)
    check_felt(follow(other, steps()), "OakTable: wood, by Name")


def test_a_project_that_reads_no_mouse_is_told_which_setting_to_change(build, tmp_path):
    other = with_input(build, tmp_path / "none", mono.INPUT_SYSTEM)
    output = follow(other, steps())
    assert "does not move: Player Settings > Active Input Handling" in output
    window = other.run("components.exe", "EditMode.ProjectChecks", "")
    assert "Mouse Hand: Player Settings > Active Input Handling" in window
    assert "Active Input Handling" not in build.run("components.exe", "EditMode.ProjectChecks", "")


def test_a_mouse_hand_on_the_camera_says_so_and_does_not_move_it(build):
    on_camera = "onto camera\t\n" + steps().replace("menu\tGameObject/HapticVLM/Mouse Hand\n", "")
    output = follow(build, on_camera)
    assert "it would move the camera" in output
    assert CAMERA in output

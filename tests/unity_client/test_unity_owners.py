"""Which scene is felt: scenes that change, wait, take over, and come back after a pause."""

import numpy as np
import pytest
from PIL import Image

from hapticvlm.client.local_service import running

pytest_plugins = ("mono_build",)


@pytest.fixture(scope="module")
def service():
    with running() as service:
        yield service


@pytest.fixture
def play(build, service, tmp_path):
    pixels = np.full((128, 128, 3), 90, np.uint8)
    Image.fromarray(pixels).save(tmp_path / "picture.jpg")
    Image.fromarray(pixels[:, :, 0]).save(tmp_path / "mask.png")
    files = str(tmp_path / "picture.jpg"), str(tmp_path / "mask.png")
    return lambda program: build.run("components.exe", program, service.url, *files)


def test_a_scene_that_waits_takes_the_outputs_when_they_are_free_and_is_felt(play):
    said = play("handover")
    assert "waiting: owner False touches sent 0 silent because another scene owns" in said
    assert "felt as wood" in said
    assert "log: HapticVLM: this scene owns the outputs now and is felt." in said
    assert "threads left 0" in said


def test_100_of_100_scene_changes_own_the_outputs(play, capsys):
    said = play("scene-changes")
    with capsys.disabled():
        print("\n" + said.splitlines()[0])
    assert "scenes 100 owned 100" in said
    assert "threads left 0" in said


def test_of_two_clients_in_one_process_the_first_connects_and_the_second_takes_over(play):
    said = play("two-clients")
    assert "first active True second Closed: the Haptic Client 'client' connects for all" in said
    assert "then second active True" in said
    assert "then none True" in said


def test_a_client_that_is_kept_between_scenes_connects_for_all_without_a_warning(play):
    assert "kept True of next True Closed warnings 0" in play("kept")


def test_after_the_headset_was_taken_off_and_on_pictures_are_shown_again(play):
    assert "shown before True and after True" in play("headset-off")


def test_a_stop_of_an_earlier_session_does_not_make_the_first_touch_unfelt(play):
    assert "touches True refused 0" in play("stopped")


def test_a_scan_in_the_editor_never_owns_the_outputs_and_ends_when_the_scene_plays(play):
    said = play("play-during-scan")
    assert "felt beside the scan True" in said
    assert "scan ended True" in said
    assert "felt while it plays" in said

"""A screen or a camera as a capture: upright, only when it changes, and closed at any time."""

import io
import os
import subprocess
import sys
import threading
from contextlib import contextmanager
from functools import partial

import numpy as np
import pytest
import tiny_video
from PIL import Image
from toolchains import require

from hapticvlm.captures import CENTRE, CaptureError, Touched, watch
from hapticvlm.captures.live import Live, camera, screen

SHOW = """
import sys, tkinter
root = tkinter.Tk()
root.overrideredirect(True)
root.geometry("400x300+0+0")
image = tkinter.PhotoImage(file=sys.argv[1])
tkinter.Label(root, image=image, borderwidth=0).place(x=0, y=0)
root.after(300, lambda: print("shown", flush=True))
root.mainloop()
"""
GREY = np.full((30, 40, 3), 90, np.uint8)


def decoded(line):
    return np.asarray(Image.open(io.BytesIO(line.image)).convert("RGB")).astype(int)


def showing(*pictures):
    @contextmanager
    def source():
        waiting = iter(pictures)
        yield lambda: next(waiting, None)

    return source


def frames(capture):
    return [line for line in capture.lines() if line.type == "frame"]


def test_a_picture_is_sent_when_it_changed_and_its_middle_is_touched():
    source = showing(GREY, GREY + 1, GREY + 60, GREY + 60)
    found = frames(watch(Live("screen", source), Touched(0.5)))
    assert [int(decoded(line).mean().round()) for line in found] == [90, 150]
    assert {line.fields["object_id"] for line in found} == {CENTRE}
    assert found[0].fields["region"] == {"x": 0.25, "y": 0.25, "w": 0.5, "h": 0.5}
    assert found[1].t_s >= 0.2


def test_what_never_changes_is_closed_from_outside():
    capture = watch(Live("screen", showing(*[GREY] * 1000)))
    threading.Timer(0.3, capture.close).start()
    assert len(frames(capture)) == 1


def test_one_eye_of_a_large_mirror_is_taken_and_made_smaller():
    both = np.zeros((3000, 6000, 3), np.uint8)
    both[:, :3000] = 200
    (line,) = frames(watch(Live("screen", showing(both), "left")))
    assert (line.fields["width"], line.fields["height"]) == (1500, 1500)
    assert decoded(line).mean() == pytest.approx(200, abs=1)


def test_a_camera_is_read_until_it_ends(tmp_path):
    path = tiny_video.write(tmp_path / "table.mp4", tiny_video.shades(3))
    assert len(frames(watch(Live("camera", partial(camera, str(path)))))) == 3


def test_a_missing_camera_is_refused_with_a_cure():
    with pytest.raises(CaptureError, match=r"camera 97: not found.*--device"):
        frames(watch(Live("camera", partial(camera, 97))))


def test_without_a_display_the_error_says_where_to_run(monkeypatch):
    if sys.platform != "linux":
        pytest.skip("other systems always have a screen")
    monkeypatch.delenv("DISPLAY", raising=False)
    with pytest.raises(CaptureError, match=r"no screen can be read .*desktop session"):
        frames(watch(Live("screen", screen)))


@pytest.fixture
def desk(tmp_path, monkeypatch):
    """A screen of its own that shows a picture: dark above, bright and red below."""
    require("Xvfb", "tkinter")
    reading, writing = os.pipe()
    server = ["Xvfb", "-displayfd", str(writing), "-screen", "0", "640x480x24", "-nolisten", "tcp"]
    silent = subprocess.DEVNULL
    with subprocess.Popen(server, pass_fds=[writing], stdout=silent, stderr=silent) as display:
        os.close(writing)
        with os.fdopen(reading) as number:
            monkeypatch.setenv("DISPLAY", f":{number.readline().strip()}")
        picture = np.zeros((300, 400, 3), np.uint8)
        picture[150:] = (220, 40, 40)
        Image.fromarray(picture).save(tmp_path / "shown.png")
        command = [sys.executable, "-c", SHOW, str(tmp_path / "shown.png")]
        with subprocess.Popen(command, stdout=subprocess.PIPE) as window:
            assert window.stdout is not None
            assert window.stdout.readline() == b"shown\n"
            yield
            window.terminate()
        display.terminate()


@pytest.mark.process
@pytest.mark.usefixtures("desk")
def test_a_window_on_a_screen_arrives_upright_and_in_its_colours():
    capture = watch(Live("screen", partial(screen, 1, (0, 0, 400, 300))))
    lines = (line for line in capture.lines() if line.type == "frame")
    seen = decoded(next(lines))
    capture.close()
    assert next(lines, None) is None
    assert seen.shape == (300, 400, 3)
    assert seen[:140].mean(axis=(0, 1)) == pytest.approx([0, 0, 0], abs=8)
    assert seen[160:].mean(axis=(0, 1)) == pytest.approx([220, 40, 40], abs=8)


def test_a_screen_without_its_extra_is_refused_with_how_to_get_it(monkeypatch):
    monkeypatch.setitem(sys.modules, "mss", None)
    with pytest.raises(CaptureError, match=r"needs mss: `.*install mss` \(the extra `screen`\)"):
        frames(watch(Live("screen", screen)))

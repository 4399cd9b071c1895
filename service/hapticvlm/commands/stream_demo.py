"""`hapticvlm stream` and `hapticvlm demo` play captures to a service, as a scene would."""

from __future__ import annotations

import argparse
import sys
import time
from contextlib import nullcontext
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from hapticvlm.commands import service_address, touch_options
from hapticvlm.commands.parsing import add_json, number_within
from hapticvlm.errors import UsageError, shell_word

if TYPE_CHECKING:
    from hapticvlm.commands.parsing import Commands

EXAMPLES = "examples"
NO_THREE = "three.js is not installed (`npm ci --prefix examples/webxr` in a checkout)"

_STREAM = """
Send a recorded VR session to a running service, as a scene would, or the live picture of a screen
or a camera, such as a headset's mirror, until Ctrl-C. Decisions are printed as they change. Screens
need the extra `screen` (mss), videos and cameras the extra `video` (OpenCV). Exit code 1: a message
had no answer or was refused; 2: the service or the capture could not be used.
"""
_DEMO = """
Play a recorded VR session through a service with simulated devices. Each touch prints a line.
The folder then contains a page with frames, decisions, plate and sound, the recorded session, a
summary, and the vibration as a WAV file.
"""


def add(commands: Commands) -> None:
    """Declare the commands and their options."""
    _add_stream(commands)
    _add_demo(commands)


def _add_stream(commands: Commands) -> None:
    stream = commands.add_parser(
        "stream",
        help="send a recorded session, a screen or a camera to a running service",
        description=_STREAM,
        examples=(
            "hapticvlm stream demo    the recorded session of `hapticvlm demo`",
            "hapticvlm stream headset.mp4 --eye left --centre 0.3",
            "hapticvlm stream screen --area 100,80,900,900    a window with a headset's mirror",
            "hapticvlm stream camera --centre 0.5",
        ),
    )
    stream.set_defaults(run=_stream)
    stream.add_argument(
        "capture",
        type=Path,
        metavar="CAPTURE",
        help="capture folder, `demo` (the one in the package), video file, `screen` or `camera`",
    )
    stream.add_argument(
        "--device",
        type=int,
        metavar="N",
        help="number of the screen (1 is the first, 0 all together) or camera (0 is the first)",
    )
    stream.add_argument(
        "--area",
        type=_area,
        metavar="X,Y,WIDTH,HEIGHT",
        help="send only these pixels of the screen, such as a window",
    )
    service_address.add_options(stream)
    stream.add_argument(
        "--eye",
        choices=("left", "right"),
        help="use this half of a video that shows both eyes side by side",
    )
    stream.add_argument(
        "--centre",
        type=number_within(0.01, 1.0),
        metavar="SHARE",
        help="touch this share of the picture's width and height, in the middle, where no .jsonl "
        "file is beside the video (0.4)",
    )
    add_json(stream)


def _add_demo(commands: Commands) -> None:
    demo = commands.add_parser(
        "demo",
        help="play a recorded session on simulated devices",
        description=_DEMO,
        examples=(
            "hapticvlm demo",
            "hapticvlm demo --browser",
            "hapticvlm demo --static site     then: python -m http.server --directory site",
        ),
    )
    demo.set_defaults(run=_demo)
    demo.add_argument(
        "--out",
        type=Path,
        metavar="FOLDER",
        default=Path("demo-output"),
        help="folder for the results (%(default)s)",
    )
    demo.add_argument(
        "--browser",
        action="store_true",
        help="open a WebXR scene in the browser and touch it yourself",
    )
    demo.add_argument(
        "--static",
        type=Path,
        metavar="FOLDER",
        help="write the page /try and the WebXR scene as plain files for any web host; they are "
        "felt and heard without a service",
    )
    touch_options.add_voice(demo, "sound", "voice of the speaker and of vibration.wav (sound)")
    demo.add_argument("--quiet", action="store_true", help="play no sound")
    add_json(demo)


def _stream(options: argparse.Namespace) -> int:
    from hapticvlm.captures import Touched, live, read, watch
    from hapticvlm.client.stream import run
    from hapticvlm.demo import CAPTURE

    touched = None if options.centre is None else Touched(options.centre)
    name, eye, number = str(options.capture), options.eye, options.device
    opened = partial(read, CAPTURE if name == "demo" else options.capture, eye, touched)
    if name == "screen":
        source = partial(live.screen, 1 if number is None else number, options.area)
        opened = partial(watch, live.Live(name, source, eye), touched)
    elif name == "camera":
        opened = partial(watch, live.Live(name, partial(live.camera, number or 0), eye), touched)
    elif number is not None or options.area is not None:
        raise UsageError("--device and --area are for screen and camera")
    capture = opened()
    service = partial(service_address.connecting, options, "hapticvlm stream")
    with service_address.reaching(options.url):
        return run(capture, service, as_json=options.json)


def _area(text: str) -> tuple[int, int, int, int]:
    numbers = [int(part) for part in text.split(",")]
    if len(numbers) != 4 or min(numbers) < 0 or not all(numbers[2:]):
        raise argparse.ArgumentTypeError(
            f"{text}: must be four numbers of pixels, x,y,width,height; width and height above 0"
        )
    x, y, width, height = numbers
    return x, y, width, height


def _demo(options: argparse.Namespace) -> int:
    if options.browser and options.static is not None:
        raise UsageError("--browser and --static: give one of them")
    if options.browser:
        return _browse()
    if options.static is not None:
        return _write_static(options.static)
    from hapticvlm.commands.progress import working

    if not options.json:
        print("hapticvlm demo: loading", flush=True)
    with nullcontext() if options.json else working("loading"):  # seconds on the first run
        from hapticvlm.demo.run import run

    return run(options.out, quiet=options.quiet, voice=options.voice, as_json=options.json)


def _write_static(folder: Path) -> int:
    """Write the page and the scene to a folder. Raises UsageError, OSError."""
    from hapticvlm.demo import static_site

    examples = _examples_folder()
    if examples is None:
        raise UsageError("this installation lacks the files of the web player; use a checkout")
    size = static_site.write(examples, folder)
    served = f"-m http.server --directory {shell_word(folder)}"
    scene = "http://127.0.0.1:8000/scene/webxr/"
    print(
        f"{folder}: {size / 1e6:.1f} MB of plain files\n"
        f"try it       {Path(sys.executable).name} {served}\n"
        "page         http://127.0.0.1:8000/\n"
        f"scene        {scene if static_site.has_room(examples) else f'left out: {NO_THREE}'}"
    )
    return 0


def _browse() -> int:
    """Serve the scene, open it, and stay until Ctrl+C. Raises ServiceError.

    Without three.js, which a checkout gets from npm, the page on which a picture is touched opens.
    """
    import webbrowser

    from hapticvlm.client.local_service import ending_on_sigterm, running
    from hapticvlm.demo import static_site

    examples = _examples_folder()
    has_scene = examples is not None and static_site.has_room(examples)
    if not has_scene:
        print(f"{NO_THREE}, so the page /try opens instead")
    folder = ["--scene", str(examples)] if has_scene else []
    try:
        with ending_on_sigterm(), running(folder) as service:
            page = service.page + ("scene/webxr/" if has_scene else "try")
            print(f"scene        {page}\ndashboard    {service.page}\nCtrl+C ends both", flush=True)
            if not webbrowser.open(page):
                print("no browser was opened; open the first address in one", flush=True)
            while service.process.poll() is None:
                time.sleep(0.5)
    except KeyboardInterrupt:
        return 0
    print("hapticvlm demo: the service ended unexpectedly", file=sys.stderr)
    return 1


def _examples_folder() -> Path | None:
    """Find the scene: in the current folder, in this checkout, or in this wheel."""
    package = Path(__file__).resolve().parents[1]
    for folder in (Path.cwd() / EXAMPLES, package.parents[1] / EXAMPLES, package / "scene"):
        if (folder / "webxr" / "index.html").is_file():
            return folder
    return None

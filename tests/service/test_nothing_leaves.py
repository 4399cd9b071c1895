"""Each command opens, writes and starts what SECURITY.md lists and no more, so nothing leaves.

A dependency that reports to its maker shows here: a name is looked up, or a file appears that is
not ours. Such reports may begin most of a minute after the start, their files appear at once.
"""

from __future__ import annotations

import re
import signal
from dataclasses import dataclass
from fnmatch import fnmatchcase
from pathlib import Path

import pytest
from gltf_room import write_room
from ports import free_port
from tracing import Trace, trace

pytestmark = [pytest.mark.process, pytest.mark.slow, pytest.mark.needs_toolchain("strace")]

ROOT = Path(__file__).parents[2]
SECURITY = (ROOT / "SECURITY.md").read_text(encoding="utf-8")
LISTED = SECURITY.partition("## What each command opens")[2].partition("\n## ")[0]
PICTURE = str(ROOT / "tests" / "browser" / "wooden_box.jpg")
CAPTURE = str(ROOT / "service" / "hapticvlm" / "demo" / "capture")
REPORTS_S = 45.0  # until those begin that begin last
# What is done on some machines only.
DEPENDS = ("pulse", "nscd", "fc-list", "::", "listen this machine", "pactl", "wpctl", "osascript")
TOKEN = re.compile("`([^`]+)`")
NO_REPORTS = {
    "ORT_DISABLE_TELEMETRY": "1",
    "HF_HUB_DISABLE_TELEMETRY": "1",
    "RAY_USAGE_STATS_ENABLED": "0",
    "DO_NOT_TRACK": "1",
}
VARIABLES = "|".join(re.findall("`([A-Z_]+)(?:=.)?`", LISTED))
DRIVEN = f"""
import hapticvlm
with hapticvlm.serve() as service, hapticvlm.connect_blocking(service.url) as client:
    client.scene([{{"object_id": "box"}}])
    image = open({PICTURE!r}, "rb").read()
    print(client.frame(image, 198, 198, format="jpeg", object_id="box")["type"])
"""


@dataclass(frozen=True)
class Case:
    """A command, how it is called, and what it prints when it is ready if it goes on for ever."""

    row: str
    arguments: tuple[str, ...]
    ready: str | None = None
    seconds: float = 3.0


def command(row: str, *arguments: str, ready: str | None = None, seconds: float = 3.0) -> Case:
    return Case(row, ("-m", "hapticvlm", *row.split(), *arguments), ready, seconds)


def program(row: str, text: str) -> Case:
    return Case(row, ("-c", text))


QUICK = [
    command("serve", "--port", "PORT", ready="ready on"),
    command("recognise", PICTURE),
    program("hapticvlm.recognise", f"import hapticvlm; hapticvlm.recognise({PICTURE!r})"),
    program("hapticvlm.serve", DRIVEN),
]
NIGHTLY = [
    command("serve", "--port", "PORT", ready="ready on", seconds=REPORTS_S),
    command("serve --lan", "--port", "PORT", ready="ready on"),
    command("serve --record", "out", "--port", "PORT", ready="ready on"),
    command("scan", "FOLDER/room.glb"),
    command("bake", "FOLDER/room.glb", "--out", "out"),
    program("hapticvlm.scan", "import hapticvlm; hapticvlm.scan('FOLDER/room.glb')"),
    command("gallery build", "FOLDER", "--out", "out"),
    command("gallery list"),
    command("gallery add", "walnut", "FOLDER/wood", "--like", "wood", "--out", "out"),
    command("feel", "metal"),
    command("feel --save", "out.wav", "metal"),
    command("study new", "out"),
    command("study report", "--paper", "--out", "out"),
    command("demo --static", "out"),
    command("stream", CAPTURE, "--url", "URL"),
    command("stop", "--url", "URL"),
    command("demo", "--quiet", "--out", "out"),
    command("doctor"),
    command("plate simulate", "--port", "PORT", ready="simulated plate on"),
    command("recogniser-app", "--port", "PORT", ready="ready on", seconds=REPORTS_S),
    command("recogniser-app --engine ray", "--port", "PORT", ready="ready on", seconds=REPORTS_S),
]


def listed(row: str) -> list[set[str]]:
    """Sockets, files and children that SECURITY.md lists for a command."""
    rows = [line.strip("|").split("|") for line in LISTED.splitlines() if line.startswith("|")]
    (cells,) = (cells for cells in rows if row in TOKEN.findall(cells[0]))
    return [set(TOKEN.findall(cell)) for cell in cells[1:4]]


def differences(found: Trace, row: str) -> list[str]:
    """What was done and is not listed, and what is listed and was not done."""
    wrong = []
    for done, patterns in zip(
        (found.sockets, found.files, found.children), listed(row), strict=True
    ):
        matches = {
            pattern: {name for name in done if fnmatchcase(name, pattern)} for pattern in patterns
        }
        wrong += [f"not listed: {name}" for name in done - set().union(*matches.values())]
        wrong += [
            f"not done: {pattern}"
            for pattern, names in matches.items()
            if not names and not any(word in pattern for word in DEPENDS)
        ]
    return sorted(wrong)


@pytest.mark.parametrize(
    "case",
    [*QUICK, *(pytest.param(case, marks=pytest.mark.nightly) for case in NIGHTLY)],
    ids=lambda case: f"{case.row} {case.seconds:g}",
)
def test_each_command_does_what_is_listed_and_no_more(
    case: Case, tmp_path: Path, request: pytest.FixtureRequest
) -> None:
    (tmp_path / "wood").mkdir()
    (tmp_path / "wood" / "box.jpg").write_bytes(Path(PICTURE).read_bytes())
    room = write_room(tmp_path / "room.glb")
    for name in (b"Walnut_Varnished", b"T_Walnut_D"):  # a surface that its texture must tell
        room.write_bytes(room.read_bytes().replace(name, b"x" * len(name)))
    places = {"PORT": str(free_port()), "FOLDER": str(tmp_path)}
    if "URL" in case.arguments:
        places["URL"] = request.getfixturevalue("service").url
    arguments = [
        re.sub("PORT|FOLDER|URL", lambda name: places[name[0]], text) for text in case.arguments
    ]

    found = trace(arguments, ready=case.ready, seconds=case.seconds)

    assert found.status in (0, -signal.SIGTERM), found.printed
    wrong = differences(found, case.row)
    assert not wrong, "\n".join(wrong)
    for variables in found.variables[1:]:
        assert NO_REPORTS.items() <= variables.items()
        assert [name for name in variables if not re.match(VARIABLES, name)] == []

"""A file with any field missing or of a wrong kind is refused in plain words that name the file."""

import copy
import json
import random
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from gltf_room import write_room
from plain_words import is_plain
from recorded_session import record
from tiny_capture import write_capture

from hapticvlm.captures.lines import read_lines
from hapticvlm.errors import HapticVLMError
from hapticvlm.materials import MATERIALS
from hapticvlm.recordings import timeline
from hapticvlm.recordings.recorder import SESSION_LOG
from hapticvlm.recordings.replay import replay
from hapticvlm.rendering.vibration.voices import Voices
from hapticvlm.scenes.reading import read_scene
from hapticvlm.vision.encoders import onnx_encoder
from hapticvlm.vision.encoders.encoder import CARD, DEFAULT, SHIPPED
from hapticvlm_studio.design import design
from hapticvlm_studio.design.patterns import paper_like

GONE = object()
WRONG: list[Any] = [
    GONE,
    None,
    "x",
    "__class__",
    True,
    -1,
    1e999,
    float("nan"),
    [],
    [[]],
    {},
    2**70,
]
MOST = 100  # damages of one kind of file in `make test`, and of a page, which takes longest
MOST_VIEWED = 10
Kind = tuple[Path, Callable[[Path], object]]


def places(document: Any, above: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """Yield the path of every value in a document, of lists only the first entries."""
    pairs: Any = ()
    if isinstance(document, dict):
        pairs = document.items()
    elif isinstance(document, list):
        pairs = list(enumerate(document))[:2]
    for key, value in pairs:
        yield (*above, key)
        yield from places(value, (*above, key))


def damaged(document: Any, place: tuple[Any, ...], wrong: Any) -> Any:
    """Return a copy with another value at one place, or without it."""
    document = copy.deepcopy(document)
    parent = document
    for key in place[:-1]:
        parent = parent[key]
    if wrong is GONE:
        del parent[place[-1]]
    else:
        parent[place[-1]] = wrong
    return document


def session(folder: Path) -> Kind:
    (folder / "record").mkdir()
    return record(folder / "record") / SESSION_LOG, lambda path: replay(path.parent, MATERIALS)


def viewed(folder: Path) -> Kind:
    path, _ = session(folder)
    return path, lambda path: timeline.read(path.parent, MATERIALS, Voices(), 60.0)


def capture(folder: Path) -> Kind:
    write_capture(folder / "capture")
    return folder / "capture" / "capture.jsonl", read_lines


def study(folder: Path) -> Kind:
    patterns = paper_like()
    design.write_design(folder, design.design(patterns, ("ann", "ben"), design.Plan()))
    return folder / design.HEAD, lambda path: design.read_design(path.parent)


def encoder(folder: Path) -> Kind:
    path = folder / CARD
    path.write_bytes((SHIPPED / DEFAULT / CARD).read_bytes())
    return path, lambda path: onnx_encoder.read_card(path.parent)


def scene(folder: Path) -> Kind:
    return write_room(folder / "room.gltf"), read_scene


KINDS = (session, viewed, capture, study, encoder, scene)


def damages(lines: list[Any], most: int) -> list[tuple[int, tuple[Any, ...], Any]]:
    """Return at most so many (line, place, wrong value) of a file, of each kind of line one."""
    first = {
        json.dumps(sorted(shape(line))): number for number, line in reversed(list(enumerate(lines)))
    }
    found = [
        (number, place, wrong)
        for number in first.values()
        for place in places(lines[number])
        for wrong in WRONG
    ]
    return random.Random(1).sample(found, min(most, len(found)))


def shape(line: Any) -> Iterator[str]:
    """Yield what tells one kind of line from another."""
    for name, value in line.items():
        yield name
        if name in ("in", "type"):
            yield value
        if name in ("out", "message"):
            yield str(value)[:40]


@pytest.mark.parametrize("is_whole", [False, pytest.param(True, marks=pytest.mark.nightly)])
@pytest.mark.parametrize("kind", KINDS)
def test_a_damaged_file_is_read_or_refused_in_plain_words(
    kind: Callable[[Path], Kind], is_whole: bool, tmp_path: Path
) -> None:
    path, read = kind(tmp_path)
    text = path.read_text()
    is_lines = path.suffix == ".jsonl"
    lines = [json.loads(row) for row in (text.splitlines() if is_lines else [text])]
    most = MOST_VIEWED if kind is viewed else MOST
    refusals = []
    for number, place, wrong in damages(lines, 500 if is_whole else most):
        rows = [*lines[:number], damaged(lines[number], place, wrong), *lines[number + 1 :]]
        path.write_text("".join(json.dumps(row) + "\n" for row in rows))
        try:
            read(path)
        except HapticVLMError as error:
            refusals.append((place, wrong, str(error)))
    assert len(refusals) >= 3
    assert [refusal for refusal in refusals if not is_plain(refusal[2])] == []
    assert [refusal for refusal in refusals if str(path.parent) not in refusal[2]] == []

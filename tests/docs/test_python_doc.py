"""Every snippet of docs/python.md and of the notebook tutorial, and the notebook, run."""

import ast
import json
import re
import shutil
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest
from gltf_room import write_room

from hapticvlm.commands.main import main
from hapticvlm.demo import CAPTURE

pytestmark = [pytest.mark.process, pytest.mark.slow]
ROOT = Path(__file__).parents[2]
PAGES = (ROOT / "docs" / "python.md", ROOT / "docs" / "tutorials" / "notebook.md")
SNIPPETS = [
    snippet
    for page in PAGES
    for snippet in re.findall(r"```python\n(.*?)```", page.read_text(encoding="utf-8"), re.DOTALL)
]
NOTEBOOK = ROOT / "examples" / "notebook" / "first_touch.ipynb"
MOST_LINES = 5  # from a picture to the drawing of its touch


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A folder with a photo, a scene and own materials, as the page takes for granted."""
    folder = tmp_path_factory.mktemp("reader")
    frames = sorted((CAPTURE / "frames").glob("*.jpg"))
    shutil.copy(frames[0], folder / "photo.jpg")
    write_room(folder / "room.glb")
    for frame in frames[8:11]:
        shutil.copy(frame, folder)
    pictures = [str(folder / frame.name) for frame in frames[8:11]]
    own = ["--like", "wood", "--out", str(folder / "my-materials")]
    assert main(["gallery", "add", "walnut", *pictures, *own]) == 0
    return folder


@pytest.mark.parametrize(
    "snippet", SNIPPETS, ids=[f"snippet {n + 1}" for n in range(len(SNIPPETS))]
)
def test_every_snippet_runs_as_it_stands(snippet, folder, monkeypatch):
    monkeypatch.chdir(folder)
    exec(compile(snippet, "docs", "exec"), {"__name__": "__main__"})


def test_the_pages_have_their_snippets_and_each_imports_what_it_uses():
    assert len(SNIPPETS) == 10
    assert all("import hapticvlm" in snippet for snippet in SNIPPETS)


@pytest.mark.nightly
async def test_the_notebook_goes_from_a_picture_to_its_touch_in_few_lines(monkeypatch):
    # A kernel runs the cells one after the other beside its own event loop, as this test does, and
    # shows the value of each cell's last line.
    monkeypatch.chdir(NOTEBOOK.parent)
    cells = json.loads(NOTEBOOK.read_text(encoding="utf-8"))["cells"]
    sources = ["".join(cell["source"]) for cell in cells if cell["cell_type"] == "code"]
    shown: list[Any] = []
    space: dict[str, Any] = {}
    for source in sources:
        *before, last = ast.parse(source).body
        assert isinstance(last, ast.Expr)
        exec(compile(ast.Module(before, []), "cell", "exec"), space)
        shown.append(eval(compile(ast.Expression(last.value), "cell", "eval"), space))
    result, touch, (material, contact_c) = shown
    assert result.felt_as in result._repr_html_()
    drawing, player = touch._repr_html_().split("<br>")
    ElementTree.fromstring(drawing)
    assert "<audio controls" in player
    assert material == result.felt_as
    assert contact_c < 32.0
    lines = [line for source in sources[:2] for line in source.splitlines() if line]
    assert len(lines) <= MOST_LINES

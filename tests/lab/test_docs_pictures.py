"""Every picture that a page shows is there, and one command draws it again."""

import re
import shutil
from pathlib import Path

import pytest
from PIL import Image

pytest.importorskip("playwright.sync_api", reason="no playwright: pip install -e '.[dev]'")

from hapticvlm_lab.bench.pictures.pages import SIZE
from hapticvlm_lab.bench.pictures.recipes import KEPT, RECIPES, names

pytestmark = pytest.mark.nightly

ROOT = Path(__file__).parents[2]
SHOWN = re.compile(r"!\[[^\]]+\]\(([^)#]+)\)")
FOLDERS = ("README.md", "docs/**/*.md", "examples/*/README.md", "service/hapticvlm_lab/*.md")
PAGES = [page for pattern in FOLDERS for page in ROOT.glob(pattern)]


def shown() -> set[Path]:
    """Pictures of docs/ that a page shows."""
    found = {
        (page.parent / name).resolve()
        for page in PAGES
        for name in SHOWN.findall(page.read_text(encoding="utf-8"))
    }
    return {path for path in found if path.parent == ROOT / "docs"}


def test_a_page_shows_no_picture_that_is_not_there() -> None:
    assert len(shown()) > 8
    assert [path.name for path in shown() if not path.is_file()] == []


def test_every_picture_shown_has_its_command_and_every_command_a_page() -> None:
    assert {path.name for path in shown()} == set(RECIPES) | KEPT
    assert not KEPT & set(RECIPES)


def test_an_unknown_picture_is_refused_with_the_names_there_are() -> None:
    with pytest.raises(KeyError, match=r"plates\.png: the pictures are dashboard\.png"):
        names(["dashboard.png", "plates.png"])
    assert names([]) == list(RECIPES)


@pytest.mark.parametrize("name", ["study-page.png", "study-experimenter.png"])
@pytest.mark.skipif(shutil.which("chromium") is None, reason="needs a browser")
def test_the_pages_of_a_study_are_drawn_as_their_words_are_now(name, tmp_path) -> None:
    RECIPES[name](tmp_path / "study", tmp_path / name)
    with Image.open(tmp_path / name) as picture:
        assert picture.size == SIZE

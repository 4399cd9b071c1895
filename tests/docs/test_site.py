"""The site of `make site`: each page as it is in the repository, a menu, a search, strict links."""

import collections
import json
import re
import shutil
import subprocess
import sys
from html.parser import HTMLParser
from pathlib import Path

import pytest
from markdown_it import MarkdownIt

ROOT = Path(__file__).parents[2]
SCRIPT = Path(".ci") / "site"
COMMONMARK = MarkdownIt("commonmark").enable("table")
BLOCKS = {"h1", "h2", "h3", "h4", "ol", "ul", "li", "table", "tr", "th", "td", "pre", "img", "em"}
NO_PAGES = {"404.html", "examples/webxr/aframe.html"}  # of the generator; a linked file

pytestmark = [pytest.mark.nightly, pytest.mark.process, pytest.mark.needs_toolchain("zensical")]


class Content(HTMLParser):
    """The text of a page and the number of its blocks, within <article> or of a fragment."""

    def __init__(self, html: str, *, is_fragment: bool) -> None:
        super().__init__()
        self.inside = is_fragment
        self.blocks: collections.Counter[str] = collections.Counter()
        self.texts: list[str] = []
        self.loaded: list[str] = []
        self.feed(html)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.inside |= tag == "article"
        self.blocks[tag] += self.inside and tag in BLOCKS
        if tag in ("script", "link", "img"):
            self.loaded += [value or "" for name, value in attrs if name in ("src", "href")]

    def handle_endtag(self, tag: str) -> None:
        self.inside &= tag != "article"

    def handle_data(self, data: str) -> None:
        self.texts += [data] * self.inside

    @property
    def text(self) -> str:
        """Without blanks, and without the sign of a heading's link."""
        return re.sub(r"[\s¶]", "", "".join(self.texts))


def build(root: Path, site: Path) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, str(root / SCRIPT), str(site)]
    return subprocess.run(command, capture_output=True, text=True, check=False)


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("built") / "site"
    built = build(ROOT, folder)
    assert built.returncode == 0, built.stdout + built.stderr
    return folder


@pytest.fixture
def project(tmp_path: Path) -> Path:
    """A repository of two pages that link to each other, with the script."""
    (tmp_path / "docs").mkdir()
    shutil.copytree(ROOT / ".ci", tmp_path / ".ci")
    (tmp_path / "README.md").write_text("# Title\nSee [the menu](docs/README.md#start).\n")
    (tmp_path / "docs" / "README.md").write_text("# Menu\n\n## Start\n[title](../README.md)\n")
    return tmp_path


def source(page: Path, site: Path) -> Path:
    """Return the Markdown of a page of the site."""
    place = ROOT / page.relative_to(site).with_suffix(".md")
    return place if place.is_file() else place.with_name("README.md")


def pages(site: Path) -> list[Path]:
    every = sorted(site.rglob("*.html"))
    return [page for page in every if page.relative_to(site).as_posix() not in NO_PAGES]


def test_every_page_has_the_text_lists_and_tables_of_its_markdown(site: Path) -> None:
    for page in pages(site):
        markdown = source(page, site).read_text(encoding="utf-8")
        meant = Content(COMMONMARK.render(markdown), is_fragment=True)
        shown = Content(page.read_text(encoding="utf-8"), is_fragment=False)
        assert (shown.blocks, shown.text) == (meant.blocks, meant.text), page


def test_every_document_is_there_and_what_it_links_to_outside_of_docs(site: Path) -> None:
    sources = {source(page, site) for page in pages(site)}
    assert {ROOT / "README.md", *(ROOT / "docs").rglob("*.md")} <= sources
    assert {ROOT / "CONTRIBUTING.md", ROOT / "firmware" / "README.md"} <= sources
    schema = "schemas/messages.schema.json"
    assert (site / schema).read_bytes() == (ROOT / schema).read_bytes()


def test_no_page_loads_anything_from_elsewhere(site: Path) -> None:
    for page in pages(site):
        loaded = Content(page.read_text(encoding="utf-8"), is_fragment=False).loaded
        assert [address for address in loaded if "//" in address] == [], page


def test_the_menu_is_that_of_the_documents_and_headings_are_searched(site: Path) -> None:
    items = json.loads((site / "search.json").read_text(encoding="utf-8"))["items"]
    sections = {item["location"]: item["path"] for item in items}
    assert sections["docs/maker.html#rung-1-vibration"][0] == "Tutorials"
    assert sections["firmware/index.html"][:1] == ["Reference"]
    (found,) = [item for item in items if item["location"] == "docs/maker.html#rung-1-vibration"]
    assert "sound exciter" in found["text"]


@pytest.mark.parametrize(
    ("link", "named"),
    [
        ("[away](docs/README.md#nowhere)", "anchor does not exist"),
        ("[away](docs/none.md)", "README.md: docs/none.md is not a file here"),
        ("[away](docs)", "README.md: docs is not a file here"),
        ("[away](../away.md)", "README.md: ../away.md is not a file here"),
    ],
)
def test_a_link_to_nothing_ends_the_build_and_keeps_the_site(
    link: str, named: str, project: Path
) -> None:
    site = project / "site"
    assert build(project, site).returncode == 0
    (project.parent / "away.md").write_text("# Away\n")
    with (project / "README.md").open("a") as page:
        page.write(link)

    refused = build(project, site)

    assert refused.returncode == 1
    assert named in refused.stderr
    assert (site / "index.html").is_file()


def test_lists_of_commonmark_keep_their_numbers_and_their_code(project: Path) -> None:
    with (project / "README.md").open("a") as page:
        page.write("\nSteps:\n1. first\n\n   ```\n   code\n   ```\n   more\n2. second\n")
        page.write("   - inner\n     words\n")

    assert build(project, project / "site").returncode == 0

    shown = Content((project / "site" / "index.html").read_text(), is_fragment=False)
    assert (shown.blocks["ol"], shown.blocks["ul"], shown.blocks["li"]) == (1, 1, 3)
    assert shown.blocks["pre"] == 1

"""`hapticvlm demo --static`: the files it writes, and the folders it refuses."""

import json
import shutil
from pathlib import Path

import pytest

from hapticvlm.commands.main import main
from hapticvlm.demo import static_site
from hapticvlm.demo.static_site import LIST
from hapticvlm.errors import UsageError

EXAMPLES = Path(__file__).parents[2] / "examples"
BUDGET = 6_000_000  # bytes


@pytest.fixture
def site(tmp_path: Path) -> Path:
    static_site.write(EXAMPLES, tmp_path / "site")
    return tmp_path / "site"


def contents(folder: Path) -> dict[str, bytes]:
    files = (path for path in folder.rglob("*") if path.is_file())
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in files}


@pytest.mark.needs_toolchain("three")
def test_it_is_within_its_budget_and_names_every_file(site: Path) -> None:
    files = contents(site)
    assert sum(len(content) for content in files.values()) < BUDGET
    assert set(json.loads(files[LIST])) | {LIST} == set(files)


def test_written_again_it_is_the_same_and_the_files_of_others_stay(site: Path) -> None:
    before = contents(site)
    (site / "CNAME").write_text("example.org")
    static_site.write(EXAMPLES, site)
    assert contents(site) == {**before, "CNAME": b"example.org"}


def test_a_run_that_did_not_end_is_done_again(site: Path) -> None:
    before = contents(site)
    names = dict.fromkeys(json.loads(before[LIST]))
    (site / LIST).write_text(json.dumps(names))
    (site / "try.js").write_text("half")
    (site / "index.html").unlink()
    static_site.write(EXAMPLES, site)
    assert contents(site) == before


@pytest.mark.parametrize("name", ["try.js", "index.html"])
def test_a_file_that_somebody_changed_stays_and_is_named(site: Path, name: str) -> None:
    (site / name).write_text("mine")
    with pytest.raises(UsageError, match=name):
        static_site.write(EXAMPLES, site)
    assert (site / name).read_text() == "mine"


@pytest.mark.parametrize("name", ["index.html", "thesis.txt"])
def test_a_folder_with_files_of_others_is_left_alone(tmp_path: Path, name: str) -> None:
    (tmp_path / name).write_text("mine")
    assert main(["demo", "--static", str(tmp_path)]) == 2
    assert contents(tmp_path) == {name: b"mine"}


@pytest.mark.parametrize("name", ["../outside.txt", "/etc/hostname", ""])
def test_a_list_that_names_a_file_outside_removes_nothing(site: Path, name: str) -> None:
    outside = site.parent / "outside.txt"
    outside.write_text("mine")
    (site / LIST).write_text(json.dumps({name: None}))
    with pytest.raises(UsageError, match="not below"):
        static_site.write(EXAMPLES, site)
    assert outside.read_text() == "mine"


def test_without_npm_it_is_the_page_with_all_that_it_needs_and_no_room(tmp_path: Path) -> None:
    with_npm = shutil.ignore_patterns("node_modules")
    shutil.copytree(EXAMPLES / "webxr", tmp_path / "examples" / "webxr", ignore=with_npm)
    static_site.write(tmp_path / "examples", tmp_path / "site")
    names = set(contents(tmp_path / "site"))
    assert {"index.html", "scene/webxr/client/player.js", "scene/webxr/baked.js"} <= names
    assert (
        "scene/webxr" not in (tmp_path / "site" / "index.html").read_text().partition("<body>")[2]
    )
    assert [name for name in names if "/lib/" in name or name == "scene/webxr/index.html"] == []

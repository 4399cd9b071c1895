"""The files of `make release`: each is installed as its user installs it, from that file."""

import fnmatch
import json
import re
import subprocess
import sys
import tarfile
import zipfile
from operator import attrgetter
from pathlib import Path

import godot_scene
import mono
import pytest
import yaml

from hapticvlm import __version__

ROOT = Path(__file__).parents[2]
RELEASE = ROOT / ".ci" / "release"
WORKFLOW = ROOT / ".github" / "workflows" / "release.yml"
FIRMWARE = ROOT / "service" / "hapticvlm" / "devices" / "plate" / "firmware"
BILL = "hapticvlm.cdx.json"
ADDRESS = "https://example.org/hapticvlm"
WAIT_S = 600

pytestmark = [pytest.mark.nightly, pytest.mark.process]


def command(*words: str, cwd: Path = ROOT, env: dict[str, str] | None = None) -> str:
    done = subprocess.run(
        words, cwd=cwd, capture_output=True, text=True, timeout=WAIT_S, check=False, env=env
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def release(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, str]:
    """The folder of the release, and what the command said."""
    out = tmp_path_factory.mktemp("release") / "out"
    words = (sys.executable, str(RELEASE), __version__, "--out", str(out))
    return out, command(*words, "--repository", ADDRESS)


def test_another_version_than_that_of_every_part_is_refused_naming_the_parts(tmp_path):
    for version, named in (("9.9.9", "unity_client/package.json"), ("0.4", "three numbers")):
        done = subprocess.run(
            [sys.executable, RELEASE, version, "--out", tmp_path / "out"],
            capture_output=True,
            text=True,
            check=False,
            timeout=WAIT_S,
        )
        assert done.returncode == 2
        assert named in done.stderr
        assert len(done.stderr.splitlines()) == 1
    assert not (tmp_path / "out").exists()


def test_it_says_what_needs_an_account_and_claims_to_publish_nothing(release):
    _, said = release
    assert "Nothing is published" in said
    for place in ("PyPI", "npm", "OpenUPM", "Godot Asset Library", "a web host"):
        assert sum(line.startswith(f"{place}: ") for line in said.splitlines()) == 1
    assert f"the tag v{__version__}," in said


def test_the_notes_are_at_most_ten_lines_and_readme_is_a_command_that_can_be_copied(release):
    out, _ = release
    notes = (out / "RELEASE_NOTES.md").read_text().splitlines()
    assert 1 <= len([line for line in notes[1:] if line]) <= 10
    links = re.findall(r"\]\((.*?)\)", "\n".join(notes))
    assert {link.partition("/blob/")[0] for link in links} == {ADDRESS}
    with tarfile.open(out / f"hapticvlm-{__version__}.tar.gz") as archive:
        file = archive.extractfile(f"hapticvlm-{__version__}/README.md")
        assert file is not None
        readme = file.read().decode()
    assert f"git clone {ADDRESS} hapticvlm" in readme
    assert "REPOSITORY" not in readme
    with zipfile.ZipFile(next(out.glob("*.whl"))) as archive:
        page = archive.read(f"hapticvlm-{__version__}.dist-info/METADATA").decode()
    assert f"]({ADDRESS}/raw/v{__version__}/docs/try.png)" in page
    linked = set(re.findall(rf"\]\({ADDRESS}/blob/v{__version__}/([^)#]*)", page))
    assert "docs/safety.md" in linked
    assert [path for path in linked if not (ROOT / path).exists()] == []


def test_the_workflow_gives_the_index_the_wheel_and_the_sources_and_nothing_else(release):
    out, _ = release
    steps = yaml.safe_load(WORKFLOW.read_text(encoding="utf-8"))["jobs"]["index"]["steps"]
    (removal,) = (step["run"].split()[1:] for step in steps if "run" in step)
    programs = (path.name for path in FIRMWARE.glob("*.hex"))
    files = [f"dist/{name}" for name in (*map(attrgetter("name"), out.iterdir()), *programs, BILL)]
    assert [one for one in removal if not fnmatch.filter(files, one)] == []
    left = [name for name in files if not any(fnmatch.fnmatch(name, one) for one in removal)]
    assert {Path(name).suffix for name in left} == {".whl", ".gz"}
    assert len(left) == 2


def test_the_wheel_installs_and_feels(release, tmp_path):
    out, _ = release
    (wheel,) = out.glob("*.whl")
    place = tmp_path / "site"
    install = ("-m", "pip", "install", "--quiet", "--no-deps", "--target", str(place), str(wheel))
    command(sys.executable, *install)
    code = "import hapticvlm; print(hapticvlm.__file__); print(hapticvlm.feel('wood', 'tap'))"
    said = command(sys.executable, "-c", code, cwd=tmp_path, env={"PYTHONPATH": str(place)})
    assert said.startswith(str(place))
    assert "wood at 22 degC" in said


@pytest.mark.needs_toolchain("node")
def test_the_npm_tarball_installs_and_is_imported_by_its_name(release, tmp_path):
    out, _ = release
    (tmp_path / "package.json").write_text('{"type": "module"}')
    quiet = ("--no-audit", "--no-fund", "--silent", "--prefer-offline")
    command("npm", "install", *quiet, str(out / f"hapticvlm-{__version__}.tgz"), cwd=tmp_path)
    code = "import('hapticvlm').then(m => console.log(typeof m.Haptics, typeof m.Felt))"
    assert command("node", "-e", code, cwd=tmp_path).split() == ["function", "function"]


def test_the_unity_tarball_compiles_and_passes_in_the_stand_in(release, tmp_path):
    mono.require()
    out, _ = release
    with tarfile.open(out / f"com.hapticvlm.client-{__version__}.tgz") as archive:
        archive.extractall(tmp_path, filter="data")
    package = tmp_path / "package"
    assert json.loads((package / "package.json").read_text())["version"] == __version__
    build = mono.Build(tmp_path / "built")
    build.folder.mkdir()
    for name, folders, using in (*mono.PACKAGED, *mono.PROGRAMS):
        moved = [
            package / folder.relative_to(mono.PACKAGE)
            if folder.is_relative_to(mono.PACKAGE)
            else folder
            for folder in folders
        ]
        build.compile(name, mono.sources(*moved), mono.QUIET, using=using)
    said = build.run("components.exe", "EditMode.SetUp", "")
    assert "first: clients 1 objects 2" in said


@pytest.mark.browser
@pytest.mark.needs_toolchain("chromium", "godot")
def test_a_godot_project_with_the_zip_feels_wood(release, tmp_path):
    out, _ = release
    project = tmp_path / "project"
    for name in ("project.godot", *(f"sample/{path.name}" for path in sample())):
        (project / name).parent.mkdir(parents=True, exist_ok=True)
        (project / name).write_bytes((godot_scene.PROJECT / name).read_bytes())
    with zipfile.ZipFile(out / f"hapticvlm-godot-{__version__}.zip") as archive:
        archive.extractall(project)
    addon = project / "addons" / "hapticvlm"
    for name in ("plugin.cfg", "LICENSE", "README.md", "icon.png"):
        assert (addon / name).stat().st_size > 50
    assert f'version="{__version__}"' in (addon / "plugin.cfg").read_text()
    with godot_scene.playing(godot_scene.sample(project)) as game:
        game.places = game.wait_for("opened")
        assert game.touch("Table/OakTable")["material"] == "wood"


def sample() -> list[Path]:
    return sorted((godot_scene.PROJECT / "sample").iterdir())


@pytest.mark.parametrize("kind", ["static", "docs"])
def test_the_pages_for_a_host_have_a_first_page_whose_links_are_in_the_archive(release, kind):
    out, _ = release
    with zipfile.ZipFile(out / f"hapticvlm-{kind}-{__version__}.zip") as archive:
        names = set(archive.namelist())
    assert "index.html" in names
    assert len(names) > 5

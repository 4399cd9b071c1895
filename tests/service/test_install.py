"""What `pip install` of the built package gives: built, installed and run outside the checkout."""

import email
import json
import os
import re
import shutil
import subprocess
import sys
import tarfile
import time
import tomllib
import urllib.request
import venv
import zipfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import urljoin

import pytest
from conftest import peer
from toolchains import give_up

from hapticvlm import __version__
from hapticvlm.client.local_service import Service

ROOT = Path(__file__).parents[2]
SOURCES = ROOT / "service"
SCENE = "hapticvlm/scene/"  # the browser scene, which a container has nobody to show to
# What npm fetches for it.
DRAWS = tuple(f"examples/webxr/node_modules/{name}/" for name in ("three", "@msgpack/msgpack"))
HOUSES = ("hapticvlm", "hapticvlm_studio", "hapticvlm_recogniser_app")  # what one wheel holds
FRAME = ROOT / "service" / "hapticvlm" / "demo" / "capture" / "frames" / "0050.jpg"
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
BINARY = frozenset({".onnx", ".safetensors", ".npz", ".jpg", ".png"})
TEXT = frozenset(
    {
        ".py",
        ".pyi",
        ".typed",
        ".txt",
        ".html",
        ".css",
        ".js",
        ".svg",
        ".json",
        ".jsonl",
        ".toml",
        ".md",
        ".csv",
    }
    | {".hex"}
)
DOCKERFILE = (ROOT / "Dockerfile").read_text().replace("\\\n", "\n")
# What `plate flash` writes; tests/firmware compares it with its source.
PREBUILT = {"plate.hex", "one-resistor.hex"}
# A place on the machine of whoever built it.
MACHINE_PATH = re.compile(r"(?<![\w.:/])/(?:work|home|root|Users|opt)/\w")
COPYLEFT = re.compile(r"General Public License|\bA?GPL", re.IGNORECASE)
WHEEL_MB, SDIST_MB = 9.0, 33.0
INSTALL_S, ANSWER_S = 3600.0, 600.0  # seconds; a busy machine starves a niced process

pytestmark = [pytest.mark.nightly, pytest.mark.slow]
needs_scene = pytest.mark.needs_toolchain("three", "@msgpack/msgpack")  # a wheel without is whole


@dataclass(frozen=True)
class Built:
    """The two archives, and how long each took in seconds."""

    sdist: Path
    wheel: Path
    seconds: float


@dataclass(frozen=True)
class Installed:
    """A fresh environment with the wheel in it, and an empty folder to be in."""

    python: Path
    folder: Path
    seconds: float

    def run(self, *arguments: str) -> subprocess.CompletedProcess[str]:
        """Run its `hapticvlm` as a user would."""
        return self.run_file(self.python.with_name("hapticvlm"), *arguments)

    def run_file(self, program: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
        return subprocess.run(
            [program, *arguments],
            cwd=self.folder,
            env=outside(),
            capture_output=True,
            text=True,
            timeout=ANSWER_S,
            check=False,
        )


def outside(**more: str) -> dict[str, str]:
    """The environment without what would let Python find the checkout."""
    kept = {name: value for name, value in os.environ.items() if not name.startswith("PYTHON")}
    return kept | more


def pip(*arguments: str) -> None:
    command = [sys.executable, "-m", "pip", *arguments]
    done = subprocess.run(
        command, capture_output=True, text=True, timeout=INSTALL_S, env=outside(), check=False
    )
    if done.returncode == 0:
        return
    give_up(f"pip cannot install: {done.stderr.strip().splitlines()[-1:]}")


def build(builder: Path, source: Path, target: str, folder: Path) -> Path:
    command = [sys.executable, "-m", "hatchling", "build", "-t", target, "-d", str(folder)]
    subprocess.run(
        command, cwd=source, env=outside(PYTHONPATH=str(builder)), check=True, timeout=INSTALL_S
    )
    (built,) = folder.iterdir()
    return built


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Built:
    """The source archive, and the wheel built from that archive alone."""
    folder = tmp_path_factory.mktemp("built")
    pip("install", "--quiet", "--target", str(folder / "builder"), "hatchling")
    started = time.monotonic()
    sdist = build(folder / "builder", ROOT, "sdist", folder / "sdist")
    with tarfile.open(sdist) as archive:
        # The safe way where Python has it (3.11.4 and later); the archive is our own.
        archive.extraction_filter = getattr(tarfile, "data_filter", lambda member, _: member)
        archive.extractall(folder / "unpacked")
    (unpacked,) = (folder / "unpacked").iterdir()
    wheel = build(folder / "builder", unpacked, "wheel", folder / "wheel")
    return Built(sdist, wheel, time.monotonic() - started)


@pytest.fixture(scope="module")
def installed(built: Built, tmp_path_factory: pytest.TempPathFactory) -> Installed:
    folder = tmp_path_factory.mktemp("installed")
    started = time.monotonic()
    venv.create(folder / "venv", with_pip=False, symlinks=True)
    python = folder / "venv" / ("Scripts" if os.name == "nt" else "bin") / "python"
    constraints = ["-c", str(ROOT / "constraints.txt")]
    quiet = ("install", "--quiet", "--no-compile")
    pip("--python", str(python), *quiet, *constraints, str(built.wheel))
    (folder / "empty").mkdir()
    return Installed(python, folder / "empty", time.monotonic() - started)


@contextmanager
def serving(installed: Installed, *options: str, **variables: str) -> Iterator[Service]:
    """Start the installed service on a free port."""
    process = subprocess.Popen(
        [installed.python.with_name("hapticvlm"), "serve", *options, "--port", "0"],
        cwd=installed.folder,
        env=outside(PYTHONUNBUFFERED="1", **variables),
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )
    service = Service(process, "", 0.0)
    assert process.stdout is not None
    try:
        for line in process.stdout:
            service.printed.append(line)
            if found := re.search(r"ready on (ws://\S+)", line):
                service.url = found.group(1)
                break
        assert service.url, "".join(service.printed)
        yield service
    finally:
        service.stop()
        process.stdout.close()


@pytest.fixture(scope="module")
def service(installed: Installed) -> Iterator[Service]:
    with serving(installed) as service:
        yield service


def texts(archive: zipfile.ZipFile) -> dict[str, str]:
    names = [name for name in archive.namelist() if Path(name).suffix not in BINARY]
    return {name: archive.read(name).decode() for name in names}


@needs_scene
def test_the_wheel_is_the_package_and_nothing_else(built):
    with zipfile.ZipFile(built.wheel) as archive:
        names = archive.namelist()
    metadata = f"hapticvlm-{__version__}.dist-info/"
    packed = {name for name in names if not name.startswith(metadata)}
    files = (path for house in HOUSES for path in (SOURCES / house).rglob("*"))
    ours = (path for path in files if path.is_file() and path.suffix != ".pyc")
    scene = {name for name in packed if name.startswith(SCENE)}
    assert packed - scene == {path.relative_to(SOURCES).as_posix() for path in ours}
    assert {Path(name).suffix for name in packed - scene} <= BINARY | TEXT
    assert {Path(name).name for name in packed if name.endswith(".hex")} == PREBUILT
    inside = packed - scene
    assert not [name for name in inside if re.search(r"(^|/)(tests?|build|shared)/", name)]
    megabytes = built.wheel.stat().st_size / 1e6
    print(f"wheel {megabytes:.1f} MB, {len(names)} files")
    assert megabytes < WHEEL_MB


def test_the_container_builds_the_same_wheel_from_the_files_that_it_copies(built, tmp_path):
    for copied in re.findall(r"^COPY (?!--)(.+) (\S+)$", DOCKERFILE, re.MULTILINE):
        for name in copied[0].split():
            target = tmp_path / "source" / name
            target.parent.mkdir(parents=True, exist_ok=True)
            (shutil.copytree if (ROOT / name).is_dir() else shutil.copy)(ROOT / name, target)
    built_there = tmp_path / "wheel"
    wheel = build(built.sdist.parents[1] / "builder", tmp_path / "source", "wheel", built_there)
    with zipfile.ZipFile(built.wheel) as ours, zipfile.ZipFile(wheel) as theirs:
        caches = {name for name in theirs.namelist() if "__pycache__" in name}
        served = {name for name in ours.namelist() if not name.startswith(SCENE)}
        assert {*theirs.namelist()} - caches == served


# Of process 1 a container's check reads the command line; here it is told that of the service.
ALIVE = (
    "import sys, urllib.request; from hapticvlm.commands import alive; "
    "urllib.request.urlopen(alive.address(sys.argv[1:]), timeout=10)"
)


def test_the_command_of_the_container_is_ready_and_found_healthy(installed):
    (words,) = re.findall(r'^CMD \["serve", (.+)\]$', DOCKERFILE, re.MULTILINE)
    assert 'CMD ["python", "-m", "hapticvlm.commands.alive"]' in DOCKERFILE
    options = [word.strip(' "') for word in words.split(",")]
    with serving(installed, *options, HAPTICVLM_TOKEN="choose-a-long-secret") as service:
        port = service.url.rstrip("/").rsplit(":", 1)[1]
        started = ("serve", *options, "--port", port)
        healthy = installed.run_file(installed.python, "-c", ALIVE, *started)
        assert healthy.returncode == 0, healthy.stderr


@needs_scene
def test_the_wheel_names_no_machine_and_no_licence_but_its_own(built):
    with zipfile.ZipFile(built.wheel) as archive:
        for name, text in texts(archive).items():
            assert not MACHINE_PATH.search(text), name
            assert not COPYLEFT.search(text), name
        licences = [name for name in archive.namelist() if name.endswith("LICENSE")]
        ours = (ROOT / "LICENSE").read_bytes()
        theirs = [name for name in licences if archive.read(name) != ours]
        assert {Path(name).parent.name for name in theirs} == {"three", "msgpack"}
        assert all(name.startswith(SCENE) for name in theirs)
        assert len(licences) > len(theirs)


def test_the_metadata_says_licence_python_and_addresses_anyone_can_open(built):
    with zipfile.ZipFile(built.wheel) as archive:
        (name,) = (name for name in archive.namelist() if name.endswith("/METADATA"))
        said = email.message_from_bytes(archive.read(name))
    assert said["License-Expression"] == "MIT AND Apache-2.0"
    assert said["Version"] == __version__
    assert said["Requires-Python"] == PROJECT["requires-python"]
    assert said.get_all("Classifier") == sorted(PROJECT["classifiers"])
    for address in said.get_all("Project-URL", []):
        assert re.fullmatch(r"[^,]+, https://[\w.-]+/\S*", address)
    ours = {"models", "remote", "video", "studio", "fleet", "ray", "screen"}
    assert set(said.get_all("Provides-Extra", [])) == ours | {"train", "unit", "dev", "docs"}


def test_the_source_archive_holds_what_is_needed_to_test_it_and_nothing_built(built):
    with tarfile.open(built.sdist) as archive:
        names = {name.split("/", 1)[1] for name in archive.getnames()}
    needed = (
        "Makefile",
        "constraints.txt",
        "hashes.txt",
        "LICENSE",
        "tests/service/test_install.py",
    )
    further = ("firmware/avr/Makefile", "unity_client/package.json", "schemas/asyncapi.yaml")
    assert not {*needed, *further} - names
    unwanted = r"(^|/)(\.venv|\.work|node_modules|__pycache__|build|demo-output|shared)/"
    scene = {name for name in names if name.startswith(DRAWS)}
    assert len(scene) < 40
    assert not [name for name in names - scene if re.search(unwanted, name)]
    made = [name for name in names if Path(name).suffix in {".elf", ".hex", ".o", ".pyc"}]
    assert {Path(name).name for name in made} == PREBUILT
    megabytes = built.sdist.stat().st_size / 1e6
    print(f"source archive {megabytes:.1f} MB, {len(names)} files")
    assert megabytes < SDIST_MB


def test_it_installs_where_no_checkout_is_seen(installed):
    where = "import hapticvlm, sys; print(hapticvlm.__file__, *sys.path, sep='\\n')"
    said = installed.run_file(installed.python, "-c", where)
    assert said.returncode == 0, said.stderr
    module, *folders = said.stdout.splitlines()
    assert Path(module).is_relative_to(installed.python.parents[1])
    assert not [folder for folder in folders if folder and Path(folder).is_relative_to(ROOT)]
    print(f"installed in {installed.seconds:.0f} s")


def test_its_command_line_says_its_version_and_every_command(installed):
    assert __version__ in installed.run("--version").stdout
    said = installed.run("--help")
    assert said.returncode == 0, said.stderr
    for command in ("serve", "stream", "replay", "recognise", "feel", "gallery", "study"):
        assert re.search(rf"^    {command} ", said.stdout, re.MULTILINE), command


def test_wood_can_be_felt(installed):
    said = installed.run("feel", "wood", "--json")
    assert said.returncode == 0, said.stderr
    assert json.loads(said.stdout)["thermal"]["material"] == "wood"


def test_what_is_not_installed_is_said_with_the_line_that_installs_it(installed):
    for arguments, packages in (
        (("serve", "--port", "0", "--vlm"), "torch transformers safetensors"),
        (("recognise", str(FRAME), "--encoder", "some/model"), "torch transformers safetensors"),
    ):
        said = installed.run(*arguments)
        assert said.returncode == 2, said.stderr
        assert f"pip --python {installed.python} install {packages}" in said.stderr
        assert "Traceback" not in said.stderr


@pytest.mark.parametrize("command", ["chart", "stability", "measure"])
def test_a_command_of_the_laboratory_says_that_it_comes_with_the_repository(installed, command):
    said = installed.run(command, "thermal", "--out", "there")
    assert said.returncode == 2, said.stderr
    (line,) = said.stderr.splitlines()
    assert line.startswith(f"hapticvlm {command}: comes with the repository")


def test_the_scripted_client_gets_its_decisions_through_object_ids(installed, service):
    said = installed.run_file(installed.python, str(ROOT / "examples" / "touch.py"), service.url)
    assert said.returncode == 0, said.stderr
    assert "table: wood" in said.stdout
    assert "kettle: metal" in said.stdout


async def test_a_frame_is_looked_at_by_the_encoder_in_the_wheel(service):
    async with peer(service) as client:
        await client.hello()
        await client.ask(type="scene", objects=[{"object_id": "thing"}], replace=True)
        picture = {"format": "jpeg", "width": 320, "height": 320, "origin": "top"}
        region = {"x": 0.25, "y": 0.25, "w": 0.5, "h": 0.5}
        frame = {**picture, "region": region, "image": FRAME.read_bytes(), "object_id": "thing"}
        answer = await client.ask(type="frame", captured_at=time.monotonic(), **frame)
    assert answer["type"] == "decision", answer
    assert "encoder" in {evidence["rung"] for evidence in answer["evidence"]}


def test_the_pages_are_in_the_wheel(service):
    with urllib.request.urlopen(service.page, timeout=ANSWER_S) as answer:
        page = answer.read().decode()
    for name in re.findall(r'(?:src|href)="/?([\w.]+\.(?:js|css|svg))"', page):
        with urllib.request.urlopen(service.page + name, timeout=ANSWER_S) as answer:
            assert answer.read() == (SOURCES / "hapticvlm" / "pages" / name).read_bytes()
    assert "dashboard.js" in page


IMPORT = re.compile(r"""(?:from|import)\s*\(?['"](\.{0,2}/[^'"]+|[\w@/.-]+)['"]""")


@needs_scene
def test_the_browser_scene_of_the_wheel_has_every_module_that_it_imports(installed):
    command = [installed.python.with_name("hapticvlm"), "demo", "--browser"]
    quiet = outside(BROWSER="true", PYTHONUNBUFFERED="1")
    with subprocess.Popen(
        command, cwd=installed.folder, env=quiet, stdout=subprocess.PIPE, text=True
    ) as demo:
        try:
            assert demo.stdout is not None
            address = demo.stdout.readline().split()[-1]
            page = fetched(address)
            (names,) = re.findall(r"importmap\">\s*({.*?})\s*</script>", page, re.DOTALL)
            modules = follow(urljoin(address, "main.js"), json.loads(names)["imports"], address)
        finally:
            demo.terminate()
    assert len(modules) > 30
    assert {"three.core.js", "index.mjs", "haptics.js"} <= {Path(url).name for url in modules}


def fetched(url: str) -> str:
    with urllib.request.urlopen(url, timeout=ANSWER_S) as answer:
        text: str = answer.read().decode()
    return text


def follow(first: str, names: dict[str, str], page: str) -> set[str]:
    """Fetch a module and all that it imports at once; returns their addresses."""
    found, waiting = set[str](), [first]
    while waiting:
        url = waiting.pop()
        if url in found or url.endswith("iwer.module.js"):  # the emulated headset is for tests
            continue
        found.add(url)
        for name in IMPORT.findall(fetched(url)):
            prefix = max((key for key in names if name.startswith(key)), key=len, default=None)
            if name.startswith(("./", "../", "/")):
                waiting.append(urljoin(url, name))
            elif prefix is not None:
                waiting.append(urljoin(page, names[prefix] + name.removeprefix(prefix)))
    return found


@pytest.mark.skipif(os.name == "nt", reason="the documents' shell is bash")
def test_every_command_of_the_documents_works_as_it_is_written(built, installed):
    """In a clean shell, in the fresh environment, with what the studio draws with."""
    studio = f"hapticvlm[studio] @ {built.wheel.as_uri()}"
    constraints = ["-c", str(ROOT / "constraints.txt")]
    pip("--python", str(installed.python), "install", "--quiet", *constraints, studio)
    script = ROOT / "tests" / "firsttime" / "run_documents.py"
    done = subprocess.run(
        [sys.executable, script, "--programs", installed.python.parent],
        capture_output=True,
        text=True,
        check=False,
        timeout=INSTALL_S,
    )
    print(done.stdout)
    assert done.returncode == 0, done.stdout + done.stderr

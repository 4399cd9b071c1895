"""Clients in another language: one made from the contract alone, and the package of the web client.

AsyncAPI's own generator makes the types of TypeScript; a client that knows nothing else is compiled
`strict` and run under node against a real service. The package is packed and installed as npm
would, and feels.
"""

from __future__ import annotations

import json
import shlex
import shutil
import subprocess
import tarfile
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from scene_cases import of_clients
from toolchains import require

from hapticvlm import __version__
from hapticvlm.client.local_service import Service

pytestmark = pytest.mark.process

HERE = Path(__file__).parent
ASYNCAPI = HERE.parents[1] / "schemas" / "asyncapi.yaml"
MODULES = HERE / "node_modules"
TSC = MODULES / "typescript" / "bin" / "tsc"
STRICT = (
    *("--strict", "--noUncheckedIndexedAccess", "--exactOptionalPropertyTypes"),
    *("--target", "es2022", "--module", "nodenext", "--moduleResolution", "nodenext"),
)
TOOL_S = 60.0  # a busy machine; some seconds on a quiet one

Run = Callable[..., str]
PACKAGE = HERE.parents[1] / "examples" / "webxr" / "client"
QUIET = ("--offline", "--ignore-scripts", "--no-audit", "--no-fund")
# What the package needs comes from here and not from the network.
BESIDE = (MODULES / "@msgpack" / "msgpack", MODULES / "ws", MODULES / "@types" / "ws")


@pytest.fixture(scope="session")
def run() -> Run:
    """A function that runs a program and returns what it says; one that fails fails a test."""
    require("node", "typescript")

    def run(*command: str | Path, cwd: Path = HERE) -> str:
        ran = subprocess.run(
            [str(part) for part in command],
            capture_output=True,
            text=True,
            timeout=TOOL_S,
            check=False,
            cwd=cwd,
        )
        assert ran.returncode == 0, ran.stdout + ran.stderr
        return ran.stdout

    return run


@pytest.fixture(scope="session")
def types(run: Run) -> str:
    """The types of TypeScript, as AsyncAPI's generator makes them of the contract."""
    return run("node", "types.mjs", ASYNCAPI)


@pytest.fixture
def folder() -> Iterator[Path]:
    """An empty folder from which node finds the tests' packages."""
    with tempfile.TemporaryDirectory(dir=MODULES, prefix=".made-") as made:
        (Path(made) / "package.json").write_text('{"type": "module"}')
        yield Path(made)


def test_every_type_has_one_name_that_says_what_it_is(types: str) -> None:
    names = [line.split()[2] for line in types.splitlines() if line.startswith("export ")]
    assert len(names) == len(set(names))
    assert {"Phase", "HandName", "Vibration", "Scene", "SceneObject"} <= set(names)
    assert not [name for name in names if "Anonymous" in name or "Reserved" in name]
    assert ": any" not in types


def test_what_the_contract_says_of_a_field_is_said_in_its_type(types: str) -> None:
    assert "   * Speed of the hand relative to the surface; at contact, the impact speed." in types
    assert "'image': Uint8Array;" in types


def test_a_strict_validator_compiles_the_published_schema(run: Run) -> None:
    said = json.loads(run("node", "strict.mjs", ASYNCAPI.parent / "messages.schema.json"))
    assert said == {"touch": True, "typo": False}


def test_a_client_made_from_the_contract_alone_feels_a_touch(
    run: Run, folder: Path, types: str, service: Service
) -> None:
    (folder / "messages.ts").write_text(types)
    shutil.copy(HERE / "client.ts", folder)
    run("node", TSC, *STRICT, folder / "client.ts")
    said = json.loads(run("node", folder / "client.js", service.url))
    assert said["welcome"]["owner"] is True
    assert (said["decision"]["object_id"], said["decision"]["material"]) == ("table", "wood")
    assert (said["vibration"]["hand"], said["vibration"]["period_ms"]) == ("right", 5)
    assert max(said["vibration"]["amplitude"]) > 0.1
    assert said["seen"]["object_id"] == "thing"


@pytest.fixture
def packed(run: Run, tmp_path: Path) -> Path:
    run("npm", "pack", PACKAGE, "--silent", "--pack-destination", tmp_path)
    return tmp_path / f"hapticvlm-{__version__}.tgz"


def test_its_types_are_those_of_the_contract(types: str) -> None:
    assert (PACKAGE / "messages.d.ts").read_text() == types, "run `make schemas`"


def test_it_holds_the_client_its_types_its_licence_and_nothing_else(packed: Path) -> None:
    with tarfile.open(packed) as archive:
        names = {name.removeprefix("package/") for name in archive.getnames()}
    source = "sound.processor.js"  # of sound.worklet.js, which is one file
    assert names == {path.name for path in PACKAGE.iterdir()} - {source}


def test_installed_it_is_felt_gives_way_takes_over_and_says_why_it_is_silent(
    run: Run, folder: Path, service: Service
) -> None:
    # Its README's first command, in a clone.
    readme = (PACKAGE / "README.md").read_text(encoding="utf-8")
    first = readme.partition("```\n")[2].splitlines()[0]
    install = first.replace("PATH/TO/CLONE", shlex.quote(str(HERE.parents[1])))
    clean = folder / "clean"
    clean.mkdir()
    (clean / "package.json").write_text('{"type": "module", "private": true}')
    run("bash", "-c", f"{install} {shlex.join(map(str, (*QUIET, *BESIDE)))}", cwd=clean)
    shutil.copy(HERE / "user.ts", clean)
    run("node", TSC, *STRICT, "--skipLibCheck", "false", clean / "user.ts", cwd=clean)
    said = json.loads(run("node", clean / "user.js", service.url))
    assert said["before"] == f"no service answers at {service.url}"
    assert said["material"] == "wood"
    assert min(said["felt"], said["feltAgain"], said["feltAfter"]) >= 0.1
    assert said["states"] == ["disconnected", f"no service answers at {service.url}", True]
    assert said["bare"] == "the browser gives this controller no motor"
    assert said["refused"] == "another scene owns the outputs"
    assert said["stopped"] == "outputs stopped: release and touch again"
    assert said["after"] == ""


def test_a_motor_plays_the_strongest_since_the_last_picture_and_rests_after_the_plan(
    run: Run,
) -> None:
    told = json.loads(run("node", HERE / "pulses.mjs"))
    assert told["steady"] == [0.5, 0.5, 0.5]
    assert told["a strike between two pictures"] == [0.8]
    assert told["an empty plan"] == told["a picture long after"] == told["too weak"] == []
    assert told["turned up"] == [1]
    assert told["a gamepad"] == [0.5]


def test_surfaces_are_stated_largest_first_and_to_an_older_service_one_alone(run: Run) -> None:
    require("three")
    said = json.loads(run("node", HERE / "surfaces.mjs"))

    oak = {"object_id": "room", "name": "Oak", "shader": {"metallic": 0}}
    assert said["1"] == {"objects": [oak], "touch": None, "frame": None}
    (room,) = said["2"]["objects"]
    assert [surface["name"] for surface in room["surfaces"]] == ["Oak", "Glass", "Steel"]
    assert room["surfaces"][0]["shader"]["opacity"] == 0.4
    assert (said["2"]["touch"], said["2"]["frame"]) == (2, 2)

    assert said["shared"]["names"] == ["Steel", "Oak", "Glass"]
    assert said["shared"]["hit"] == 0
    steel = said["shared"]["shader"]
    assert (steel["metallic"], steel["roughness"]) == (1, 0.25)
    assert [said["opacity"][each] for each in ("blended", "masked")] == [0.25, None]
    assert said["mapped"] == {"name": "T_Planks_D.png/mat3", "shader": {}}
    assert said["many"]["length"] == 64
    assert (said["many"]["largest"], said["many"]["smallest"]) == (0, 0)
    (told,) = said["many"]["told"]
    assert "6 small surfaces" in told


def test_the_package_gets_the_good_part_of_every_scene_felt_and_names_the_rest(
    run: Run, tmp_path: Path, service: Service
) -> None:
    cases = of_clients()
    (tmp_path / "cases.json").write_text(json.dumps(cases))
    said = json.loads(run("node", HERE / "scene_cases.mjs", service.url, tmp_path / "cases.json"))
    for case, heard in zip(cases, said, strict=True):
        assert heard["felt"] == case["felt"], case["name"]
        told = bool(heard["left_out"]), bool(heard["warnings"])
        assert told == (case["tells"], case["tells"]), case["name"]
        assert heard["silence"] == "", case["name"]


def test_two_sources_of_one_hand_are_one_hand_and_a_vanished_one_lets_go(run: Run) -> None:
    told = json.loads(run("node", HERE / "hands.mjs"))
    assert told["two sources"] == ["contact right", "slide right", "release right"]
    assert told["a vanished source"] == ["contact left", "release left"]
    assert told["both hands"] == ["contact left", "contact right"]
    assert told["of no hand"] == ["contact right"]


def test_a_motor_that_refuses_says_so_in_silence_and_not_in_every_picture(run: Run) -> None:
    told = json.loads(run("node", HERE / "pulses.mjs"))
    assert told["a motor that refuses"] == [0, "the motor refuses to vibrate: not supported"]
    assert told["of no hand"] == [0.5]
    assert told["owned and lost"] == [0.5, 0]

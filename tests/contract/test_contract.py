"""A client in another language, from the contract alone: types made of asyncapi.yaml, then a touch.

AsyncAPI's own generator makes the types of TypeScript; a client that knows nothing else is compiled
`strict` and run under node against a real service.
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from hapticvlm.client.local_service import Service, running

HERE = Path(__file__).parent
ASYNCAPI = HERE.parents[1] / "schemas" / "asyncapi.yaml"
MODULES = HERE / "node_modules"
TSC = MODULES / "typescript" / "bin" / "tsc"
STRICT = (
    *("--strict", "--noUncheckedIndexedAccess", "--exactOptionalPropertyTypes"),
    *("--target", "es2022", "--module", "nodenext", "--moduleResolution", "nodenext"),
)
TOOL_S = 60.0  # a busy machine; some seconds on a quiet one

pytestmark = pytest.mark.process


def node(*arguments: str | Path) -> subprocess.CompletedProcess[str]:
    """Run node on these; what it says is returned, also of a failure."""
    return subprocess.run(
        ["node", *map(str, arguments)],
        capture_output=True,
        text=True,
        timeout=TOOL_S,
        check=False,
        cwd=HERE,
    )


@pytest.fixture(scope="module")
def folder() -> Iterator[Path]:
    """A folder from which node finds the packages."""
    reason = None if shutil.which("node") else "no node: see .ci/toolchains"
    if not reason and not TSC.exists():
        reason = "no packages: npm ci --prefix tests/contract"
    if reason and os.environ.get("CI"):
        pytest.fail(reason)
    if reason:
        pytest.skip(reason)
    with tempfile.TemporaryDirectory(dir=MODULES, prefix=".made-") as made:
        (Path(made) / "package.json").write_text('{"type": "module"}')
        yield Path(made)


@pytest.fixture(scope="module")
def types(folder: Path) -> str:
    """The types as the generator makes them."""
    made = node("types.mjs", ASYNCAPI)
    assert made.returncode == 0, made.stderr
    (folder / "messages.ts").write_text(made.stdout)
    return made.stdout


@pytest.fixture(scope="module")
def service() -> Iterator[Service]:
    with running() as service:
        yield service


@pytest.fixture(scope="module")
def said(folder: Path, types: str, service: Service) -> Any:
    """What the client was answered by a real service."""
    assert types
    shutil.copy(HERE / "client.ts", folder / "client.ts")
    compiled = node(TSC, *STRICT, folder / "client.ts")
    assert compiled.returncode == 0, compiled.stdout
    ran = node(folder / "client.js", service.url)
    assert ran.returncode == 0, ran.stderr
    return json.loads(ran.stdout)


def test_every_type_has_one_name_that_says_what_it_is(types: str) -> None:
    names = [line.split()[2] for line in types.splitlines() if line.startswith("export ")]
    assert len(names) == len(set(names))
    assert {"Phase", "HandName", "Vibration", "Scene", "SceneObject"} <= set(names)
    assert not [name for name in names if "Anonymous" in name or "Reserved" in name]
    assert ": any" not in types


def test_what_the_contract_says_of_a_field_is_said_in_its_type(types: str) -> None:
    assert "   * Of the hand relative to the surface; at contact how fast it hits." in types
    assert "'image': Uint8Array;" in types


def test_a_client_made_from_the_contract_alone_feels_a_touch(said: Any) -> None:
    assert said["welcome"]["owner"] is True
    assert (said["decision"]["object_id"], said["decision"]["material"]) == ("table", "wood")
    assert (said["vibration"]["hand"], said["vibration"]["period_ms"]) == ("right", 5)
    assert max(said["vibration"]["amplitude"]) > 0.1
    assert said["seen"]["object_id"] == "thing"

"""The fixture that the tests of this folder share."""

import shutil
from pathlib import Path

import mono
import numpy as np
import pytest
from PIL import Image
from shared_build import built_once


@pytest.fixture(scope="session")
def build() -> mono.Build:
    """The compiled package, stubs and programs, for `pytest_plugins = ("mono_build",)`."""
    mono.require()
    return mono.Build(built_once("mono", compile_all, mono.PACKAGE, mono.HERE))


@pytest.fixture
def side():
    """Pixels of the pictures that a streamer sends."""
    return 128


@pytest.fixture
def play(build: mono.Build, request, tmp_path, side):
    """Run a program of components/ against the module's service, or with these arguments.

    Its pictures are noise, whose middle is the object. No thread may be left when it ends.
    """
    noise = np.random.default_rng(1).integers(0, 255, (side, side, 3), dtype=np.uint8)
    Image.fromarray(noise).save(tmp_path / "picture.jpg")
    Image.fromarray(np.pad(np.full((side // 2, side // 2), 255, np.uint8), side // 4)).save(
        tmp_path / "mask.png"
    )

    def run(program: str, *arguments: str, **options) -> str:
        given = arguments or (request.getfixturevalue("service").url,)
        variables = {"PICTURES": str(tmp_path)}
        output = build.run("components.exe", program, *given, variables=variables, **options)
        assert "threads left 0" in output, output
        return output

    return run


def compile_all(folder: Path) -> None:
    built = mono.Build(folder)
    for name, folders, using in (*mono.PACKAGED, *mono.PROGRAMS):
        built.compile(name, mono.sources(*folders), mono.QUIET, using=using)
    for name, folders, using in mono.TESTS:
        built.compile(name, mono.sources(*folders), mono.QUIET, f"-r:{mono.NUNIT}", using=using)
    shutil.copy(mono.NUNIT, folder)

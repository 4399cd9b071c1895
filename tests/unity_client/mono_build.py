"""The fixture that the tests of this folder share."""

import shutil
from pathlib import Path

import mono
import pytest
from shared_build import built_once


@pytest.fixture(scope="session")
def build() -> mono.Build:
    """The compiled package, stubs and programs, for `pytest_plugins = ("mono_build",)`."""
    mono.require()
    return mono.Build(built_once("mono", compile_all, mono.PACKAGE, mono.HERE))


def compile_all(folder: Path) -> None:
    built = mono.Build(folder)
    for name, folders, using in (*mono.PACKAGED, *mono.PROGRAMS):
        built.compile(name, mono.sources(*folders), mono.QUIET, using=using)
    for name, folders, using in mono.TESTS:
        built.compile(name, mono.sources(*folders), mono.QUIET, f"-r:{mono.NUNIT}", using=using)
    shutil.copy(mono.NUNIT, folder)

"""The fixture that the tests of this folder share."""

import shutil

import mono
import pytest


@pytest.fixture(scope="session")
def build(tmp_path_factory: pytest.TempPathFactory) -> mono.Build:
    """The compiled package, stubs and programs, for `pytest_plugins = ("mono_build",)`."""
    mono.require()
    built = mono.Build(tmp_path_factory.mktemp("mono"))
    for name, folders, using in (*mono.PACKAGED, *mono.PROGRAMS):
        built.compile(name, mono.sources(*folders), mono.QUIET, using=using)
    for name, folders, using in mono.TESTS:
        built.compile(name, mono.sources(*folders), mono.QUIET, f"-r:{mono.NUNIT}", using=using)
    shutil.copy(mono.NUNIT, built.folder)
    return built

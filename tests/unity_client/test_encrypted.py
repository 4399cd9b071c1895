"""The package's connection on Mono over wss, with an authority that Mono trusts."""

import os
import subprocess

import pytest
from certificates import Authority

from hapticvlm.client.local_service import running

pytest_plugins = ("mono_build",)


@pytest.fixture(scope="module")
def authority(tmp_path_factory: pytest.TempPathFactory) -> Authority:
    return Authority(tmp_path_factory.mktemp("authority"))


def trusted(authority, folder):
    """A folder of root certificates for Mono: one per file, named by the hash of its subject."""
    command = ["openssl", "x509", "-in", authority.ca, "-noout", "-subject_hash"]
    done = subprocess.run(command, capture_output=True, text=True, check=True, timeout=60)
    roots = folder / ".mono" / "new-certs" / "Trust"
    roots.mkdir(parents=True)
    (roots / f"{done.stdout.strip()}.0").write_bytes(authority.ca.read_bytes())
    return {**os.environ, "XDG_CONFIG_HOME": str(folder)}


@pytest.fixture(scope="module")
def service(authority):
    with running(authority.sign().flags) as service:
        yield service


@pytest.fixture
def url(service):
    return service.url.replace("127.0.0.1", "localhost")  # Mono verifies names, not addresses


def run(build, environment, *arguments):
    return subprocess.run(
        ["mono", str(build.folder / "programs.exe"), *arguments],
        capture_output=True,
        text=True,
        env=environment,
        timeout=240.0,
        check=False,
    )


def test_a_touch_is_felt_over_wss_by_name(build, url, authority, tmp_path):
    done = run(build, trusted(authority, tmp_path), "round-trips", url, "20")
    assert done.returncode == 0, done.stdout + done.stderr
    assert "material wood" in done.stdout


def test_an_authority_that_mono_does_not_know_is_not_trusted(build, service, url, tmp_path):
    (tmp_path / ".mono").mkdir()
    before = len(service.printed)
    done = run(build, {**os.environ, "XDG_CONFIG_HOME": str(tmp_path)}, "refused", url)
    assert done.returncode == 0, done.stdout + done.stderr
    assert done.stdout.startswith("Waiting: no service answers")  # one that it trusts
    assert not any("owner" in line for line in service.printed[before:])

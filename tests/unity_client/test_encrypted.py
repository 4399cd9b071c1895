"""The package's connection on Mono over wss, with an authority that Mono trusts."""

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
    return {"XDG_CONFIG_HOME": str(folder)}


@pytest.fixture(scope="module")
def service(authority):
    with running(authority.sign().flags) as service:
        yield service


@pytest.fixture
def url(service):
    return service.url.replace("127.0.0.1", "localhost")  # Mono verifies names, not addresses


def test_a_touch_is_felt_over_wss_by_name(build, url, authority, tmp_path):
    variables = trusted(authority, tmp_path)
    output = build.run("programs.exe", "round-trips", url, "20", variables=variables)
    assert "material wood" in output


def test_an_authority_that_mono_does_not_know_is_not_trusted(build, service, url, tmp_path):
    (tmp_path / ".mono").mkdir()
    before = len(service.printed)
    output = build.run("programs.exe", "refused", url, variables={"XDG_CONFIG_HOME": str(tmp_path)})
    assert output.startswith("Waiting: no service answers")  # one that it trusts
    assert not any("owner" in line for line in service.printed[before:])

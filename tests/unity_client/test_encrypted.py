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


def run(build, url, environment, seconds):
    return subprocess.run(
        ["mono", str(build.folder / "programs.exe"), "round-trips", url, "20"],
        capture_output=True,
        text=True,
        env=environment,
        timeout=seconds,
        check=False,
    )


def test_a_touch_is_felt_over_wss_by_name(build, authority, tmp_path):
    with running(authority.sign().flags) as service:
        url = service.url.replace("127.0.0.1", "localhost")  # Mono verifies names, not addresses
        done = run(build, url, trusted(authority, tmp_path), 240.0)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "material wood" in done.stdout


def test_an_authority_that_mono_does_not_know_is_not_trusted(build, authority):
    with running(authority.sign().flags) as service:
        url = service.url.replace("127.0.0.1", "localhost")
        with pytest.raises(subprocess.TimeoutExpired):  # it keeps retrying
            run(build, url, None, 15.0)
        assert not any("owner" in line for line in service.printed)

"""Encrypted connections with a user's certificate, made by openssl for these tests."""

import os
import re
import shutil
import ssl
import subprocess
import sys
import time
import urllib.request
from collections.abc import Iterator
from pathlib import Path

import pytest
from certificates import Authority, Pair

from hapticvlm.client import connect, trusting
from hapticvlm.client.local_service import Service, running
from hapticvlm.server.web import certificate

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def authority(tmp_path_factory: pytest.TempPathFactory) -> Authority:
    return Authority(tmp_path_factory.mktemp("authority"))


@pytest.fixture(scope="module")
def pair(authority: Authority) -> Pair:
    return authority.sign()


@pytest.fixture(scope="module")
def service(pair: Pair) -> Iterator[Service]:
    with running(pair.flags) as found:
        yield found


def test_the_ready_line_names_wss_and_https(service):
    until = time.monotonic() + 60.0
    while "priority" not in (said := "".join(service.printed)) and time.monotonic() < until:
        time.sleep(0.05)
    assert "ready on wss://127.0.0.1:" in said
    assert "status page  https://127.0.0.1:" in said


async def test_a_client_that_does_not_know_the_authority_does_not_connect(service):
    with pytest.raises(ssl.SSLCertVerificationError):
        async with connect(service.url):
            pass


@pytest.mark.nightly
async def test_a_certificate_for_another_name_is_not_taken(authority):
    elsewhere = authority.sign("elsewhere", names="DNS:elsewhere.example").flags
    with (
        running(elsewhere) as service,
        pytest.raises(ssl.SSLCertVerificationError, match="mismatch"),
    ):
        async with connect(service.url, tls=trusting(authority.ca)):
            pass


def test_the_status_is_served_over_https(service, authority):
    with urllib.request.urlopen(service.page + "healthz", context=trusting(authority.ca)) as page:
        assert page.read() == b"ok\n"


@pytest.mark.filterwarnings("ignore::DeprecationWarning")
def test_versions_before_1_2_are_refused(service, authority):
    old = trusting(authority.ca)
    old.minimum_version = ssl.TLSVersion.TLSv1
    old.maximum_version = ssl.TLSVersion.TLSv1_1
    old.set_ciphers("ALL:@SECLEVEL=0")
    with pytest.raises(OSError, match=r"(?i)ssl|tls|handshake"):
        urllib.request.urlopen(service.page + "healthz", context=old)


def streamed(capture: Path, url: str, *more: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "hapticvlm", "stream", str(capture), "--url", url, *more],
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )


@pytest.fixture
def capture(tmp_path: Path) -> Path:
    scene = '{"t_s": 0, "type": "scene", "replace": true, "objects": [{"object_id": "a"}]}'
    (tmp_path / "capture.jsonl").write_text(scene)
    return tmp_path


def test_a_capture_is_streamed_over_wss(service, authority, capture):
    done = streamed(capture, service.url, "--ca", str(authority.ca))
    assert done.returncode == 0, done.stderr
    assert "unanswered: 0" in " ".join(done.stdout.split())


def test_streaming_says_what_to_do_about_trust_and_schemes(service, capture):
    for url, more, cure in (
        (service.url, [], "--ca FILE"),
        (service.url.replace("wss", "ws"), [], "that `hapticvlm serve` prints"),
        (service.url, ["--ca", "none.pem"], "No such file"),
        (service.url.replace("wss", "http"), [], "ws://HOST:PORT/"),
    ):
        done = streamed(capture, url, *more)
        assert done.returncode == 2
        assert cure in done.stderr
        assert "Traceback" not in done.stderr


def test_what_a_certificate_is_for_and_how_long_is_known(pair):
    found = certificate.load(pair.cert, pair.key)
    assert found.names == {"localhost", "127.0.0.1"}
    assert found.ends_at == ssl.cert_time_to_seconds("Dec 31 23:59:59 2099 GMT")


def complaint(cert: Path, key: Path) -> str:
    with pytest.raises(ValueError, match="--tls") as refused:
        certificate.load(cert, key)
    assert len(str(refused.value).splitlines()) == 1
    return str(refused.value)


def test_a_pair_that_cannot_be_served_is_refused_naming_file_and_cure(authority, pair, tmp_path):
    other, old = authority.sign("other"), authority.sign("old", ends="20210101000000Z")
    client = authority.sign("client", usage="clientAuth")
    locked, none = tmp_path / "locked.key", tmp_path / "none.pem"
    make = ["openssl", "pkey", "-in", pair.key, "-aes256", "-passout", "pass:x", "-out", locked]
    subprocess.run(make, check=True, capture_output=True, timeout=60)
    assert "belongs to another" in complaint(pair.cert, other.key)
    assert "expired; make a new one" in complaint(old.cert, old.key)
    assert "purpose" in complaint(client.cert, client.key)
    assert "locked with a passphrase" in complaint(pair.cert, locked)
    assert "--tls-cert" in complaint(none, pair.key)
    assert "No such file" in complaint(pair.cert, none)
    assert "holds no private key" in complaint(pair.cert, pair.cert)
    assert "holds no certificate" in complaint(pair.key, pair.key)
    broken = tmp_path / "broken.pem"
    broken.write_text("-----BEGIN CERTIFICATE-----\nAAAA\n-----END CERTIFICATE-----\n")
    assert "can't be used" in complaint(broken, pair.key)
    broken.write_bytes(b"\x30\x82")  # DER
    assert "holds no certificate" in complaint(broken, pair.key)


@pytest.mark.skipif(os.name != "posix", reason="POSIX permissions")
def test_a_key_that_others_can_read_is_warned_of(pair, tmp_path, caplog):
    open_key = Path(shutil.copy(pair.key, tmp_path))
    for mode, is_open in ((0o600, False), (0o640, True), (0o604, True)):
        caplog.clear()
        open_key.chmod(mode)
        certificate.load(pair.cert, open_key)
        assert ("chmod 600" in caplog.text) == is_open


def test_the_steps_of_the_documentation_make_a_certificate_that_is_served_and_trusted(tmp_path):
    text = (ROOT / "docs" / "connecting.md").read_text()
    (steps,) = re.findall(r"```sh\n(.*?)```", text, re.DOTALL)
    script = "set -e\n" + steps.replace("rsa:3072", "rsa:2048")  # 3072 bits take their time
    subprocess.run(
        ["bash", "-c", script], check=True, capture_output=True, cwd=tmp_path, timeout=300
    )
    found = certificate.load(tmp_path / "service.pem", tmp_path / "service.key")
    assert found.names == {"localhost", "127.0.0.1", "192.168.1.5"}
    verify = ["openssl", "verify", "-x509_strict", "-CAfile", "ca.pem", "service.pem"]
    done = subprocess.run(verify, capture_output=True, text=True, cwd=tmp_path, check=False)
    assert done.returncode == 0, done.stderr


def test_half_a_pair_is_refused_in_one_line(pair):
    done = subprocess.run(
        [sys.executable, "-m", "hapticvlm", "serve", "--tls-cert", pair.cert],
        capture_output=True,
        text=True,
        check=False,
        timeout=60,
    )
    assert done.returncode == 2
    assert "go together" in done.stderr
    assert len(done.stderr.strip().splitlines()) == 1

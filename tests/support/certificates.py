"""Certificates of a made-up authority, made with the openssl program for one test run."""

from __future__ import annotations

import subprocess
from dataclasses import dataclass
from pathlib import Path

from toolchains import require

NAMES = "DNS:localhost,IP:127.0.0.1"
_ROOT = """
[req]
distinguished_name = name
prompt = no
x509_extensions = ca
[name]
CN = HapticVLM test authority
[ca]
basicConstraints = critical,CA:true
keyUsage = critical,keyCertSign,cRLSign
subjectKeyIdentifier = hash
[own]
new_certs_dir = {folder}
database = {folder}/index.txt
serial = {folder}/serial
certificate = {folder}/ca.pem
private_key = {folder}/ca.key
default_md = sha256
policy = any
unique_subject = no
[any]
commonName = supplied
"""


@dataclass(frozen=True)
class Pair:
    """A certificate and its key, as files in PEM."""

    cert: Path
    key: Path

    @property
    def flags(self) -> list[str]:
        return ["--tls-cert", str(self.cert), "--tls-key", str(self.key)]


class Authority:
    """One that signs; `ca` is what its clients are told to trust."""

    def __init__(self, folder: Path) -> None:
        require("openssl")
        self.folder = folder
        self.ca = folder / "ca.pem"
        (folder / "index.txt").touch()
        (folder / "serial").write_text("01\n")
        self._config = folder / "openssl.cnf"
        self._config.write_text(_ROOT.format(folder=folder))
        key = folder / "ca.key"
        _openssl(
            *("req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:P-256", "-nodes"),
            *("-config", str(self._config), "-days", "30", "-keyout", str(key)),
            *("-out", str(self.ca)),
        )

    def sign(
        self,
        name: str = "service",
        *,
        names: str = NAMES,
        ends: str = "20991231235959Z",
        usage: str = "serverAuth",
    ) -> Pair:
        """Make a key and a certificate for these names, valid until `ends`."""
        pair = Pair(self.folder / f"{name}.pem", self.folder / f"{name}.key")
        request, more = self.folder / f"{name}.csr", self.folder / f"{name}.ext"
        more.write_text(f"subjectAltName = {names}\nextendedKeyUsage = {usage}\n")
        _openssl(
            *("req", "-new", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:P-256", "-nodes"),
            *("-subj", f"/CN={name}", "-keyout", str(pair.key), "-out", str(request)),
        )
        _openssl(
            *("ca", "-batch", "-notext", "-config", str(self._config), "-name", "own"),
            *("-startdate", "20200101000000Z", "-enddate", ends, "-extfile", str(more)),
            *("-in", str(request), "-out", str(pair.cert)),
        )
        pair.key.chmod(0o600)
        return pair


def _openssl(*arguments: str) -> None:
    done = subprocess.run(
        ["openssl", *arguments], capture_output=True, text=True, timeout=120, check=False
    )
    assert done.returncode == 0, done.stderr

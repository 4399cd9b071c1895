"""What the service needs is taken by the hash of its file; anything else is refused."""

import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
HASHES = (ROOT / "hashes.txt").read_text()
SMALL = "segno"  # one file of 74 kB, no dependencies


def normal(name: str) -> str:
    return re.sub(r"[-_.]+", "-", name).lower()


def pins(text: str) -> dict[str, str]:
    found = re.findall(r"^([\w.-]+)==([\w.+]+)", text, re.MULTILINE)
    return {normal(name): version for name, version in found}


def test_every_file_has_a_hash_and_no_place_is_named():
    for pin in re.split(r"^(?=[\w])", HASHES, flags=re.MULTILINE)[1:]:
        assert re.findall(r"--hash=sha256:[0-9a-f]{64}\b", pin), pin
    assert "://" not in HASHES


def test_all_that_the_service_needs_is_there_at_the_version_that_is_tested():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())
    needed = [*project["project"]["dependencies"], *project["build-system"]["requires"]]
    known, tested = pins(HASHES), pins((ROOT / "constraints.txt").read_text())
    assert {normal(re.split(r"[<>=;\[ ]", one)[0]) for one in needed} <= set(known)
    assert {name: tested.get(name) for name in known} == known, "`make hashes` writes them anew"


@pytest.mark.parametrize("is_ours", [True, False], ids=["the file", "another file"])
def test_a_file_with_another_hash_is_refused(tmp_path, is_ours):
    ((version, hashes),) = re.findall(rf"^{SMALL}==(\S+) (.*?)(?=^\w)", HASHES, re.M | re.S)
    given = hashes if is_ours else re.sub(r"[0-9a-f]{64}", "0" * 64, hashes)
    wanted = tmp_path / "wanted.txt"
    wanted.write_text(f"{SMALL}=={version} {given}")
    pip = [sys.executable, "-m", "pip", "install", "--quiet", "--target", str(tmp_path / "there")]
    checked = [*pip, "--no-deps", "--require-hashes", "-r", str(wanted)]
    said = subprocess.run(checked, capture_output=True, text=True, check=False)
    assert (said.returncode == 0) is is_ours, said.stderr
    assert is_ours or "DO NOT MATCH THE HASHES" in said.stderr

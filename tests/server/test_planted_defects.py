"""Planted defects follow the code, and each of the service's is caught by the test named with it.

Those of the firmware compile it again each time: three of them run here, all by `make fuzz`.
"""

import json
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from each_case import each

sys.path.insert(0, str(Path(__file__).parent))
import mutate
from firmware.mutations import MUTATIONS

pytestmark = pytest.mark.spread
ENDANGERING = (
    "no over-temperature",
    "faults not latched",
    "no dead-man: a setpoint never lapses",
)


@each(defect=mutate.DEFECTS)
def test_a_planted_defect_fits_the_code_and_names_a_test_that_is_there(defect):
    source = (mutate.ROOT / "service/hapticvlm" / defect.file).read_text(encoding="utf-8")
    assert defect.sound in source
    name, _, chosen = defect.test.partition(" -k ")
    tests = re.findall(r"def (test_\w+)", (mutate.ROOT / name).read_text(encoding="utf-8"))
    assert [test for test in tests if chosen in test]


@pytest.fixture(scope="module")
def scratch(tmp_path_factory):
    folder = tmp_path_factory.mktemp("planted")
    shutil.copytree(mutate.ROOT / "service/hapticvlm", folder / "hapticvlm")
    return folder


@pytest.mark.nightly
@pytest.mark.process
@pytest.mark.slow
@pytest.mark.parametrize("defect", mutate.DEFECTS, ids=lambda defect: defect.planted.strip())
def test_a_planted_defect_of_the_service_is_caught(defect, scratch):
    assert mutate.is_caught(defect, scratch)


@pytest.mark.nightly
@pytest.mark.process
@pytest.mark.needs_toolchain("g++", "make", "doctest")
@pytest.mark.parametrize("name", ENDANGERING)
def test_a_planted_defect_of_the_firmware_is_caught(name):
    assert [each.name for each in MUTATIONS if name in each.name] == [name]
    command = [sys.executable, str(mutate.ROOT / "tests/firmware/mutate.py"), name]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    result = json.loads(done.stdout.splitlines()[-1])
    assert (result["planted"], result["survived"]) == (1, [])

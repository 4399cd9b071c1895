"""Planted defects follow the code, and a few of them are planted in every run.

All are planted by `make fuzz`. Which few it is now depends on the day, so that a run can be had
again, and a month of runs has planted nearly every one.
"""

import datetime
import random
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))
import mutate
from firmware.mutations import MUTATIONS

TODAY = random.Random(datetime.datetime.now(tz=datetime.UTC).date().toordinal())
OF_THE_SERVICE = TODAY.sample(range(len(mutate.DEFECTS)), 2)
OF_THE_FIRMWARE = TODAY.choice([each.name for each in MUTATIONS if not each.chip])


@pytest.mark.parametrize("defect", mutate.DEFECTS, ids=lambda defect: defect.planted.strip())
def test_a_planted_defect_fits_the_code_and_names_a_test_that_is_there(defect):
    source = (mutate.ROOT / "service/hapticvlm" / defect.file).read_text(encoding="utf-8")
    assert defect.sound in source
    name, _, chosen = defect.test.partition(" -k ")
    tests = re.findall(r"def (test_\w+)", (mutate.ROOT / name).read_text(encoding="utf-8"))
    assert [test for test in tests if chosen in test]


def planted(script, *which):
    command = [sys.executable, str(mutate.ROOT / "tests" / script), *which]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    print(done.stdout)
    return done


@pytest.mark.process
def test_todays_defects_of_the_service_are_caught():
    done = planted("server/mutate.py", *map(str, OF_THE_SERVICE))
    assert done.returncode == 0, done.stdout + done.stderr
    assert "2 of 2 caught" in done.stdout


@pytest.mark.process
@pytest.mark.skipif(shutil.which("g++") is None, reason="no g++: see .ci/toolchains")
def test_todays_defect_of_the_firmware_is_caught():
    done = planted("firmware/mutate.py", OF_THE_FIRMWARE)
    assert done.returncode == 0, done.stdout + done.stderr
    assert '"survived": []' in done.stdout

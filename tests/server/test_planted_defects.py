"""The list of planted defects follows the code; `tests/server/mutate.py` plants them one by one."""

import re
import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))
import mutate


@pytest.mark.parametrize("defect", mutate.DEFECTS, ids=lambda defect: defect.planted.strip())
def test_a_planted_defect_fits_the_code_and_names_a_test_that_is_there(defect):
    source = (mutate.ROOT / "service/hapticvlm" / defect.file).read_text(encoding="utf-8")
    assert defect.sound in source
    name, _, chosen = defect.test.partition(" -k ")
    tests = re.findall(r"def (test_\w+)", (mutate.ROOT / name).read_text(encoding="utf-8"))
    assert [test for test in tests if chosen in test]

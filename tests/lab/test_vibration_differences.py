"""The service's table of differences between materials is what the laboratory computes."""

from pathlib import Path

import pytest

import hapticvlm.rendering.vibration
from hapticvlm_lab.bench.vibration import differences


@pytest.mark.nightly
def test_the_services_table_is_the_one_that_the_command_prints() -> None:
    folder = Path(next(iter(hapticvlm.rendering.vibration.__path__)))
    shipped = (folder / "differences.toml").read_text(encoding="utf-8")
    assert differences.table() == shipped

"""Every single fault on boards whose plate's thermistors lag by 1.0 s, with three faces.

See test_faults_lag_0_3.py.
"""

from __future__ import annotations

import pytest

from .build import Chip
from .faults import FAULTS, Fault
from .trials import trials_of_lagging_beads

pytestmark = pytest.mark.nightly
LAG_S = 1.0


@pytest.mark.parametrize("face_j_per_k", [0.6, 1.0, 1.5])
@pytest.mark.parametrize("fault", FAULTS, ids=[fault.name for fault in FAULTS])
def test_the_skin_is_safe_on_a_board_whose_beads_lag(
    chip: Chip, fault: Fault, face_j_per_k: float
) -> None:
    for outcome in trials_of_lagging_beads(chip, fault, LAG_S, face_j_per_k):
        assert outcome.is_safe, outcome
        assert outcome.shoot_through == 0

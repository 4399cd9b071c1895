"""`calibrate plate` measures the plate resistance of palms through the compiled firmware."""

from __future__ import annotations

import numpy as np
import pytest
from unknown_plate import UnknownPlate

from hapticvlm_studio.calibration.plate_flow import PlateEstimate, estimate, middle_c
from hapticvlm_studio.calibration.plate_trajectory import swing

from .build import Chip
from .scenes import Rig

OVERHEAD_S = 3e-4  # of a turn of the host, whose clock is independent of the board's
RESISTANCES = (2e-4, 5e-4, 1e-3)


def found(chip: Chip, seed: int) -> list[PlateEstimate]:
    """Place palms, one after the other, on a plate of which only the type is known."""
    unknown = UnknownPlate(seed)
    board = chip.board(seed=seed)
    board.plant = unknown._plant
    rig = Rig(board)

    def turn() -> float:
        rig.peltier.poll()
        board.advance(OVERHEAD_S)
        return board.now

    palms = []
    try:
        around_c = middle_c(rig.peltier.advance(turn()).sink_c)
        bare = swing(rig.peltier, around_c, turn)
        for resistance in RESISTANCES:
            unknown.lay(resistance)
            palms.append(estimate(bare, swing(rig.peltier, around_c, turn)))
    finally:
        rig.close()
        board.close()
    return palms


@pytest.mark.nightly
def test_palms_are_found_by_the_heat_they_take(chip: Chip) -> None:
    palms = found(chip, 1)

    shares = np.array([palm.plate_resistance for palm in palms]) / RESISTANCES
    print(shares.round(2))
    assert shares == pytest.approx(np.ones(3), rel=0.3)
    assert all(
        palm.low < planted < palm.high for palm, planted in zip(palms, RESISTANCES, strict=True)
    )

"""Every single fault on boards whose plate's thermistors lag by 0.3 s; see `lagging.py`."""

from __future__ import annotations

import pytest

from .lagging import safe_with_a_lag_of

pytestmark = pytest.mark.nightly

test_the_skin_is_safe_on_a_board_whose_beads_lag = safe_with_a_lag_of(0.3)

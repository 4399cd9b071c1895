"""A service that ends in the middle of the demo is told in a sentence, not in a traceback."""

import pytest
from rich.console import Console

from hapticvlm.captures import read
from hapticvlm.client.local_service import running
from hapticvlm.demo import CAPTURE
from hapticvlm.demo import run as demo
from hapticvlm.demo.show import Show
from hapticvlm.errors import HapticVLMError

pytestmark = pytest.mark.process


def test_a_service_that_ends_in_the_middle_is_told_in_a_sentence():
    class Watched(Show):
        """Kills the service at the first event that the demo shows."""

        def receive(self, event):
            super().receive(event)
            service.process.kill()

    with running() as service, pytest.MonkeyPatch.context() as patched:
        patched.setattr(demo, "Show", Watched)
        with pytest.raises(HapticVLMError, match="the service ended before the demo did"):
            demo._performed(read(CAPTURE), service, Console(quiet=True))

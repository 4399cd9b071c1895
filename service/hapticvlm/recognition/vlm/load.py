"""The model that the settings name: in this process, or behind a url. Wires, decides nothing."""

from __future__ import annotations

import os
import sys

from hapticvlm.recognition.vlm.answers import Vlm, VlmSettings

# Threads of OpenMP that wait by spinning take the cores from the gateway and from each other:
# with a third busy process on two cores a pass was seen to take eight times as long.
PASSIVE = {"OMP_WAIT_POLICY": "PASSIVE", "GOMP_SPINCOUNT": "0"}


def prepare_process(threads: int) -> bool:
    """Make waiting threads sleep in this process; False when torch was imported before: too late.

    OpenMP reads these when torch is imported, so a process that is to load a model calls this, or
    load_vlm, first.
    """
    for name, value in {**PASSIVE, "OMP_NUM_THREADS": str(threads)}.items():
        os.environ.setdefault(name, value)
    return "torch" not in sys.modules


def load_vlm(settings: VlmSettings) -> Vlm:
    """Load a model, or connect to the endpoint at `url`. Raises VlmError."""
    if settings.url is not None:
        from hapticvlm.recognition.vlm.remote import RemoteVlm

        return RemoteVlm(settings)
    prepare_process(settings.threads)
    from hapticvlm.recognition.vlm.local import load_local

    return load_local(settings)

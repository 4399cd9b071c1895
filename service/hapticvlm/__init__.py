"""HapticVLM: virtual objects feel like what they look like.

The names of `__all__` are the Python interface (docs/python.md). Each is imported when it is first
used, so that `import hapticvlm` costs nothing. Their types are in `__init__.pyi`: this file imports
none of its own parts, since all of them import it.

Nothing leaves the machine unasked, also not through a dependency. Several report to their makers
by default: onnxruntime keeps a device id and sends events, among them the path of Python. Every
process of ours (a command, a child, a program that imports this package) imports this file before
any of them and passes its environment on to its children, so their reports are switched off here.
"""

import os
from importlib import import_module

__version__ = "0.4.0"
__all__ = [
    "MATERIALS",
    "BlockingClient",
    "Client",
    "FeltTouch",
    "HapticVLMError",
    "PictureRecogniser",
    "RecognisedPicture",
    "Refused",
    "ScannedScene",
    "Service",
    "TouchEnded",
    "connect",
    "connect_blocking",
    "feel",
    "materials",
    "recognise",
    "scan",
    "serve",
]
_MODULES = {
    "MATERIALS": "hapticvlm.materials",
    "BlockingClient": "hapticvlm.client.blocking",
    "Client": "hapticvlm.client.connection",
    "FeltTouch": "hapticvlm.touches.felt",
    "HapticVLMError": "hapticvlm.errors",
    "PictureRecogniser": "hapticvlm.vision.picture_recogniser",
    "RecognisedPicture": "hapticvlm.vision.picture_recogniser",
    "Refused": "hapticvlm.client.connection",
    "ScannedScene": "hapticvlm.scenes.scanned_scene",
    "Service": "hapticvlm.client.local_service",
    "TouchEnded": "hapticvlm.client.connection",
    "connect": "hapticvlm.client.connection",
    "connect_blocking": "hapticvlm.client.blocking",
    "feel": "hapticvlm.touches.felt",
    "recognise": "hapticvlm.vision.picture_recogniser",
    "scan": "hapticvlm.scenes.scanned_scene",
    "serve": "hapticvlm.client.local_service",
}

# A value of the user's environment is replaced: the promise of SECURITY.md has no exception.
_NO_REPORTS = {
    "ORT_DISABLE_TELEMETRY": "1",  # onnxruntime
    "HF_HUB_DISABLE_TELEMETRY": "1",  # transformers and huggingface_hub
    "RAY_USAGE_STATS_ENABLED": "0",  # ray
    "DO_NOT_TRACK": "1",  # the common name; huggingface_hub reads it, too
}
os.environ.update(_NO_REPORTS)


def __getattr__(name: str) -> object:
    if name == "materials":
        return import_module("hapticvlm.materials")
    if name not in _MODULES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = globals()[name] = getattr(import_module(_MODULES[name]), name)
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})

"""What is asked beside the embedded encoder, perhaps on another machine: VLM, shared recogniser."""

from __future__ import annotations

import importlib.util
import os

from hapticvlm.commands.serve_config import Serving
from hapticvlm.processes.vlm import VlmWorker
from hapticvlm.recognition.remote.settings import RemoteSettings
from hapticvlm.recognition.vlm.contract import DEFAULT_MODEL, VlmSettings


def vlm_worker(serving: Serving) -> VlmWorker | None:
    """Make the process that asks a VLM, if one is wanted. Raises ModuleNotFoundError."""
    if serving.vlm is None and serving.vlm_url is None:
        return None
    if serving.vlm_url is None:
        _require_models()
    return VlmWorker(
        VlmSettings(
            model=serving.vlm or DEFAULT_MODEL,
            url=serving.vlm_url,
            token=os.environ.get("HAPTICVLM_VLM_TOKEN"),
            device=serving.vlm_device,
            threads=serving.vlm_threads,
            image_tokens=serving.image_tokens,
            timeout_s=serving.vlm_timeout,
        )
    )


def _require_models() -> None:
    """Refuse at the start a model that could not be loaded later."""
    for name in ("torch", "transformers"):
        if importlib.util.find_spec(name) is None:
            raise ModuleNotFoundError(name=name)


def remote_settings(serving: Serving) -> RemoteSettings | None:
    """Return which shared recogniser is asked, if one is named. Raises LineError."""
    if serving.recogniser_url is None:
        return None
    settings = RemoteSettings(
        url=serving.recogniser_url,
        token=os.environ.get("HAPTICVLM_RECOGNISER_TOKEN") or None,
        gallery=serving.recogniser_gallery,
        hash=serving.recogniser_hash,
        deadline_s=serving.recogniser_deadline,
        format=serving.recogniser_crops,
        may_be_clear=serving.recogniser_clear_text,
    )
    settings.address()
    return settings

"""Loads a vision-language model by folder or name; refuses one that cannot work.

Folders and names are found as those of encoders (`networks`). A model that lacks weights is
refused, and so is one that does not fit the free memory, because the system would kill the process
without a message. Asks no questions.
"""

from __future__ import annotations

import logging
from contextlib import suppress
from pathlib import Path
from typing import Any, Literal

from hapticvlm.errors import short_line
from hapticvlm.vision.encoders import networks
from hapticvlm.vision.encoders.encoder import EncoderError
from hapticvlm.vlm.chat import Chat
from hapticvlm.vlm.contract import VlmError, VlmSettings
from hapticvlm.vlm.limits import LEAST_TOKENS
from hapticvlm.vlm.network import CURE_MEMORY, Network, guarded

TOKENIZERS = ("tokenizer.json", "tokenizer.model", "vocab.json", "vocab.txt", "spiece.model")
Precision = Literal["bfloat16", "float32"]
BYTES: dict[Precision, int] = {"bfloat16": 2, "float32": 4}
MEMINFO = Path("/proc/meminfo")
CPUINFO = Path("/proc/cpuinfo")
_UNKNOWN = "the model `%s` takes %.1f GB of memory; how much is free cannot be asked on this system"

logger = logging.getLogger(__name__)


def load(settings: VlmSettings, precision: Precision | None) -> tuple[Network, Chat]:
    """Load a model with its tokenizer and image processor. Raises VlmError.

    precision: of the weights; None for the faster one here that fits the memory.
    """
    _require_sense(settings)
    folder = _ready(settings)
    if fault := networks.fault_of(folder) or _without_tokenizer(folder):
        raise _unloadable(settings, fault)
    precision = precision or _faster_precision(folder, settings)
    if settings.device == "cpu":
        _require_memory(folder, settings, precision)
    try:
        with guarded(f"loading the model `{settings.model}`"):
            chat_parts = _chat_parts(folder, settings)
            model = _model(folder, settings, precision)
    except VlmError:
        raise
    except Exception as error:  # noqa: BLE001 - whatever a foreign file causes
        raise _unloadable(settings, short_line(error)) from None
    image_id = _image_id(model.config)
    if image_id is None:
        raise _unloadable(settings, f"a {type(model).__name__} does not take pictures")
    return Network(model), Chat(*chat_parts, image_id)


def _ready(settings: VlmSettings) -> Path:
    """Set up the libraries; return the model's folder, downloaded if necessary."""
    what = f"model `{settings.model}`"
    try:
        own = networks.find(what, settings.model)
        networks.set_up(what, settings.device, settings.threads)
        return own or networks.from_hub(what, settings.model)
    except EncoderError as error:
        raise VlmError(str(error)) from None


def _faster_precision(folder: Path, settings: VlmSettings) -> Precision:
    # Processors without bfloat16 arithmetic emulate it, at a quarter of the speed of float32.
    is_native = CPUINFO.is_file() and "bf16" in CPUINFO.read_text()
    if settings.device == "cpu" and not is_native:
        if free_bytes() is None:
            logger.warning(_UNKNOWN, settings.model, _needed_bytes(folder, "float32") / 1e9)
        with suppress(VlmError):
            _require_memory(folder, settings, "float32")
            return "float32"
    return "bfloat16"


def free_bytes() -> int | None:
    """Return how much memory a new process may take; None if the system does not report it."""
    if not MEMINFO.is_file():
        return None
    memory = dict(row.split(":", 1) for row in MEMINFO.read_text().splitlines() if ":" in row)
    free = memory.get("MemAvailable")
    return None if free is None else 1024 * int(free.split()[0])


def _without_tokenizer(folder: Path) -> str | None:
    is_there = any((folder / name).is_file() for name in TOKENIZERS)
    return None if is_there else f"{TOKENIZERS[0]} is missing: copy it from the model's page"


def _require_sense(settings: VlmSettings) -> None:
    if settings.image_tokens < LEAST_TOKENS:
        raise VlmError(
            f"{settings.image_tokens} image tokens are too few; a picture needs {LEAST_TOKENS}"
        )
    if settings.device not in ("cpu", "cuda"):
        raise VlmError(f"`{settings.device}` is not a device; it must be cpu or cuda")
    if settings.threads < 1:
        raise VlmError(f"{settings.threads} threads are too few; a model needs 1 or more")


def _require_memory(folder: Path, settings: VlmSettings, precision: Precision) -> None:
    """Refuse weights that do not fit the memory."""
    needed = _needed_bytes(folder, precision)
    free = free_bytes()
    if free is not None and needed > free:
        problem = (
            f"model `{settings.model}` needs {needed / 1e9:.1f} GB; {free / 1e9:.1f} GB are free"
        )
        raise VlmError(f"out of memory: {problem}; {CURE_MEMORY}")


def _model(folder: Path, settings: VlmSettings, precision: Precision) -> Any:  # noqa: ANN401
    import torch
    import transformers

    library: Any = transformers
    model, report = library.AutoModelForImageTextToText.from_pretrained(
        folder,
        dtype=getattr(torch, precision),
        attn_implementation="sdpa",  # accepts the mask of a packed pass
        local_files_only=True,
        output_loading_info=True,
        trust_remote_code=False,
        use_safetensors=True,
        weights_only=True,
    )
    lacking = sorted(report["missing_keys"])
    if lacking:
        raise _unloadable(settings, f"it lacks {len(lacking)} weights, {lacking[0]} first")
    return model.to(settings.device).eval()


def _chat_parts(folder: Path, settings: VlmSettings) -> tuple[Any, Any, Any]:
    """Load tokenizer and image processor, and the whole processor if it alone counts tokens."""
    import transformers

    library: Any = transformers
    here: dict[str, Any] = {"local_files_only": True, "trust_remote_code": False}
    tokenizer = library.AutoTokenizer.from_pretrained(folder, **here)
    images = library.AutoImageProcessor.from_pretrained(folder, **here)
    if not hasattr(images, "merge_size"):
        return tokenizer, images, library.AutoProcessor.from_pretrained(folder, **here)
    cell = (images.patch_size * images.merge_size) ** 2
    most = settings.image_tokens  # the least is a quarter at most, since it is rounded up
    budget = {"min_pixels": min(LEAST_TOKENS, most // 4) * cell, "max_pixels": most * cell}
    return tokenizer, library.AutoImageProcessor.from_pretrained(folder, **here, **budget), None


def _image_id(config: Any) -> int | None:  # noqa: ANN401 - a config of any kind
    for name in ("image_token_id", "image_token_index"):
        token_id: int | None = getattr(config, name, None)
        if token_id is not None:
            return token_id
    return None


def _unloadable(settings: VlmSettings, why: str) -> VlmError:
    return VlmError(f"model `{settings.model}` cannot be loaded ({why}); {networks.FOLDER}")


def _needed_bytes(folder: Path, precision: Precision) -> int:
    """Return the memory that a folder's weights take; assumes that the files hold bfloat16."""
    stored = sum(path.stat().st_size for path in folder.glob("*.safetensors"))
    return stored * BYTES[precision] // BYTES["bfloat16"]

"""Finds a vision-language model by folder or name and loads it; refuses one that cannot work.

A folder is read without any connection. A name is looked up in this machine's cache; only if it is
not there, the hub is asked once, and then a download starts. Code that comes with a model is never
run. A model that lacks weights is refused, and so is one that does not fit the free memory, because
the system would kill the process without a message. Asks no questions.
"""

from __future__ import annotations

import logging
import time
from contextlib import suppress
from pathlib import Path
from typing import Any, Literal

from hapticvlm.errors import installing, short_line
from hapticvlm.vision.encoders.networks import (
    CONFIG,
    HUB_NAME,
    HUB_S,
    PACKAGES,
    fault_of,
    quieten_libraries,
)
from hapticvlm.vlm.chat import Chat
from hapticvlm.vlm.contract import VlmError, VlmSettings
from hapticvlm.vlm.limits import LEAST_TOKENS
from hapticvlm.vlm.network import CURE_MEMORY, Network, guarded

FILES = ("*.json", "*.safetensors", "*.txt", "*.jinja", "*.model")
TOKENIZERS = ("tokenizer.json", "tokenizer.model", "vocab.json", "vocab.txt", "spiece.model")
Precision = Literal["bfloat16", "float32"]
BYTES: dict[Precision, int] = {"bfloat16": 2, "float32": 4}
TRIALS = 8
MEMINFO = Path("/proc/meminfo")
FOLDER = "give a folder that save_pretrained wrote, with network, tokenizer and image processor"

logger = logging.getLogger(__name__)


def load(settings: VlmSettings, precision: Precision) -> tuple[Network, Chat]:
    """Load a model with its tokenizer and image processor. Raises VlmError."""
    _require_sense(settings)
    _quieten(settings)
    folder = find(settings.model)
    if fault := fault_of(folder) or _without_tokenizer(folder):
        raise _unloadable(settings, fault)
    _require_device(settings)
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


def faster_precision(settings: VlmSettings) -> Precision:
    """Choose the faster precision of the weights that fits the memory. Raises VlmError.

    Processors without bfloat16 arithmetic emulate it, at a quarter of the speed of float32.
    """
    _quieten(settings)
    if settings.device == "cpu" and _is_float32_faster():
        with suppress(VlmError):
            _require_memory(find(settings.model), settings, "float32")
            return "float32"
    return "bfloat16"


def _is_float32_faster() -> bool:
    import torch

    def seconds(kind: torch.dtype) -> float:
        left = torch.ones(64, 1024, dtype=kind)
        right = torch.ones(1024, 1024, dtype=kind)
        times = []
        for _ in range(TRIALS):
            start = time.perf_counter()
            torch.mm(left, right)
            times.append(time.perf_counter() - start)
        return min(times)

    return seconds(torch.float32) < seconds(torch.bfloat16)


def find(name: str) -> Path:
    """Return a model's folder, by folder or name; downloads it if necessary. Raises VlmError."""
    return find_here(name) or _from_hub(name)


def find_here(name: str) -> Path | None:
    """Return a model's folder; None for a name of the hub. Raises VlmError; imports no library."""
    path = Path(name).expanduser()
    if path.is_dir():
        if not (path / CONFIG).is_file():
            raise VlmError(f"model `{name}` has no {CONFIG}; {FOLDER}")
        return path
    if path.exists() or not HUB_NAME.fullmatch(name):
        raise VlmError(f"model `{name}` is not a folder; {FOLDER}, or a name of the hub")
    return None


def free_bytes() -> int | None:
    """Return how much memory a new process may take; None if the system does not report it."""
    if not MEMINFO.is_file():
        return None
    memory = dict(row.split(":", 1) for row in MEMINFO.read_text().splitlines() if ":" in row)
    free = memory.get("MemAvailable")
    return None if free is None else 1024 * int(free.split()[0])


def _from_hub(name: str) -> Path:
    import huggingface_hub

    try:
        # The same patterns as below, or a copy of just these files would count as incomplete.
        return Path(
            huggingface_hub.snapshot_download(
                name, allow_patterns=list(FILES), local_files_only=True
            )
        )
    except Exception:  # noqa: BLE001 - not in the cache; the library has several errors for it
        logger.info("model `%s` is not on this machine", name)
    try:
        huggingface_hub.model_info(name, timeout=HUB_S)
        logger.warning("model `%s` is not on this machine: downloading it", name)
        return Path(huggingface_hub.snapshot_download(name, allow_patterns=list(FILES)))
    except Exception as error:  # noqa: BLE001 - no network, no such name, no access, offline mode
        problem = f"model `{name}` is not a folder and cannot be downloaded ({short_line(error)})"
        raise VlmError(f"{problem}; {FOLDER}") from None


def _without_tokenizer(folder: Path) -> str | None:
    is_there = any((folder / name).is_file() for name in TOKENIZERS)
    return None if is_there else f"{TOKENIZERS[0]} is missing: copy it from the model's page"


def _require_sense(settings: VlmSettings) -> None:
    if settings.image_tokens < LEAST_TOKENS:
        raise VlmError(
            f"{settings.image_tokens} image tokens are too few; a picture needs {LEAST_TOKENS}"
        )
    if settings.threads < 1:
        raise VlmError(f"{settings.threads} threads are too few; a model needs 1 or more")


def _quieten(settings: VlmSettings) -> None:
    try:
        quieten_libraries(settings.threads)
    except ImportError as error:
        problem = f"a model in process needs torch and transformers ({error})"
        raise VlmError(f"{problem}: {installing(PACKAGES)}") from None


def _require_device(settings: VlmSettings) -> None:
    import torch

    if settings.device not in ("cpu", "cuda"):
        raise VlmError(f"`{settings.device}` is not a device; it must be cpu or cuda")
    if settings.device == "cuda" and not torch.cuda.is_available():
        raise VlmError(
            "torch finds no CUDA device; use cpu, or install the torch that fits the GPU"
        )


def _require_memory(folder: Path, settings: VlmSettings, precision: Precision) -> None:
    """Refuse weights that do not fit the memory; assumes that the file holds bfloat16."""
    stored = sum(path.stat().st_size for path in folder.glob("*.safetensors"))
    needed = stored * BYTES[precision] // BYTES["bfloat16"]
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
    return VlmError(f"model `{settings.model}` cannot be loaded ({why}); {FOLDER}")

"""Networks of transformers: found by folder or by name, and read; quickly refused where they lack.

A folder never touches the network. A name is looked up in this machine's cache, and only then asked
for, once, before torch is imported or a download starts. Code that comes with a network is never
run, weights are read from safetensors alone, and a network that lacks some is refused, since
transformers would fill in random ones. Knows no
picture.
"""

from __future__ import annotations

import hashlib
import logging
import os
import re
from collections.abc import Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from hapticvlm import documents
from hapticvlm.errors import installing
from hapticvlm.vision.encoders.encoder import CARD, EncoderError
from hapticvlm.vision.encoders.imagenet import is_imagenet

Kind = Literal["features", "classes", "words"]

CONFIG = "config.json"
PREPROCESSING = ("preprocessor_config.json", "processor_config.json")
WEIGHTS = ".safetensors"
PICKLED = (".bin", ".pt", ".pth", ".ckpt", ".pkl", ".h5", ".msgpack")
CLASSIFIER = "ForImageClassification"
FINGERPRINT = 8  # hexadecimal digits of the weights' SHA-256 in a folder's label
HUB_S = 10.0  # for the hub to answer whether it has a network
HUB_NAME = re.compile(r"[\w.-]+(/[\w.-]+)?")
PACKAGES = "torch transformers safetensors"
FOLDER = "give a folder that save_pretrained wrote, with network and image processor"

logger = logging.getLogger(__name__)


def find(name: str) -> Path | str:
    """Return the folder of that name, or the name of a network of the hub. Raises EncoderError."""
    path = Path(name).expanduser()
    if not path.exists() and HUB_NAME.fullmatch(name):
        _require_reachable(name)
        return name
    if path.is_file():
        raise EncoderError(f"encoder `{name}` is a file: give the folder it lies in")
    if not path.is_dir():
        raise EncoderError(f"encoder `{name}` is no folder here: give one, or a name of the hub")
    if (path / CONFIG).is_file():
        return _require_preprocessing(path)
    inner = {file.parent.name for mark in (CONFIG, CARD) for file in path.glob(f"*/{mark}")}
    if inner:
        text = f"encoder `{name}` holds networks in folders of their own"
        raise EncoderError(f"{text}: give one of {', '.join(sorted(inner))}")
    text = f"encoder `{name}` holds neither {CARD} nor {CONFIG}"
    raise EncoderError(f"{text}: give a network's own folder")


@dataclass(frozen=True, slots=True)
class Network:
    """A network of transformers, and what lies beside it.

    kind: "classes" for a classifier of ImageNet, "words" for one of pictures and text, else
    "features". tokenizer: of "words", else None. revision: of the hub, "" for a folder.
    """

    model: Any
    kind: Kind
    preprocessor: Mapping[str, Any]
    tokenizer: Any
    revision: str


def read(source: Path | str) -> Network:
    """Read the network of what was found, and its preprocessor_config.json. Raises EncoderError."""
    _require_safe(source)
    try:
        network, missing = _load(source)
    except Exception as error:  # noqa: BLE001 - whatever a foreign file trips
        text = f"encoder `{source}` cannot be loaded ({short_line(error)})"
        raise EncoderError(f"{text}; {FOLDER}") from None
    lacking = sorted(key for key in missing if not key.startswith("pooler."))
    if lacking:
        text = f"encoder `{source}` lacks {len(lacking)} weights of its network, {lacking[0]} first"
        raise EncoderError(f"{text}; {FOLDER}")
    return network


def label(source: Path | str) -> str:
    """Name a network as galleries remember it, telling apart those of one folder name."""
    if isinstance(source, str):
        return source
    digest = hashlib.sha256()
    for path in sorted(source.iterdir()):
        if path.suffix == WEIGHTS:
            with documents.open_file(path) as file:
                digest.update(hashlib.file_digest(file, "sha256").digest())
    return f"{source.resolve().name}-{digest.hexdigest()[:FINGERPRINT]}"


def short_line(error: Exception) -> str:
    """Shorten an error's text to one line of bounded length."""
    return (" ".join(str(error).split()) or type(error).__name__)[:160]


def _require_preprocessing(folder: Path) -> Path:
    if not any((folder / name).is_file() for name in PREPROCESSING):
        text = f"encoder `{folder}` has no {PREPROCESSING[0]}"
        raise EncoderError(f"{text}: copy it there from the network it was trained from")
    return folder


def _require_reachable(name: str) -> None:
    """Ask the hub once for a network that is not cached; downloads would retry for long."""
    try:
        import huggingface_hub
    except ImportError as error:
        text = f"encoder `{name}` needs transformers ({error})"
        raise EncoderError(f"{text}: {installing(PACKAGES)}") from None
    try:
        if not isinstance(huggingface_hub.try_to_load_from_cache(name, CONFIG), str):
            huggingface_hub.model_info(name, timeout=HUB_S)
            logger.warning("encoder `%s` is not on this machine: downloading it", name)
    except Exception as error:  # noqa: BLE001 - no network, no such name, no access, offline mode
        text = f"encoder `{name}` is no folder here and cannot be downloaded ({short_line(error)})"
        raise EncoderError(f"{text}; {FOLDER}") from None


def _require_safe(source: Path | str) -> None:
    """Refuse a folder whose weights are only pickled, or that needs code of its own."""
    if not isinstance(source, Path):
        return
    names = sorted(path.name for path in source.iterdir())
    pickled = [name for name in names if name.endswith(PICKLED)]
    if pickled and not any(name.endswith(WEIGHTS) for name in names):
        text = f"encoder `{source}` has its weights pickled ({pickled[0]}), which can run any code"
        raise EncoderError(f"{text} when read; save it as safetensors")
    with suppress(OSError, ValueError):
        config = documents.parse_json(documents.read_bytes(source / CONFIG))
        if isinstance(config, dict) and config.get("auto_map") and not _is_known(config):
            text = f"encoder `{source}` cannot be loaded: it needs code that comes with it"
            raise EncoderError(f"{text} (auto_map), which is never run; {FOLDER}")


def _is_known(config: Mapping[str, Any]) -> bool:
    from transformers import CONFIG_MAPPING

    return config.get("model_type") in CONFIG_MAPPING


def _load(source: Path | str) -> tuple[Network, Iterable[str]]:
    """Read the network, and the names of weights it lacks."""
    if isinstance(source, Path):
        return _load_from(source, is_local=True)
    with suppress(OSError):
        return _load_from(source, is_local=True)
    return _load_from(source, is_local=False)


def _load_from(source: Path | str, *, is_local: bool) -> tuple[Network, Iterable[str]]:
    import torch
    from transformers import AutoConfig, AutoTokenizer, BaseImageProcessor

    config = AutoConfig.from_pretrained(source, local_files_only=is_local, trust_remote_code=False)
    given, _ = BaseImageProcessor.get_image_processor_dict(source, local_files_only=is_local)
    kind = _kind(config)
    model, info = _loader(config, kind).from_pretrained(
        source,
        config=config,
        dtype=torch.float32,
        local_files_only=is_local,
        use_safetensors=True,
        output_loading_info=True,
        trust_remote_code=False,
    )
    words = None
    if kind == "words":
        words = AutoTokenizer.from_pretrained(
            source, local_files_only=is_local, trust_remote_code=False
        )
    revision = getattr(config, "_commit_hash", None) or ""
    return Network(model.eval(), kind, given, words, revision), info["missing_keys"]


def _kind(config: Any) -> Kind:  # noqa: ANN401 - transformers is untyped
    if hasattr(config, "text_config") and hasattr(config, "vision_config"):
        return "words"
    classifies = any(str(a).endswith(CLASSIFIER) for a in config.architectures or ())
    if classifies and is_imagenet(config.num_labels, config.id2label):
        return "classes"
    return "features"


def _loader(config: Any, kind: Kind) -> Any:  # noqa: ANN401
    """Choose the class of transformers that loads it."""
    from transformers import MODEL_MAPPING, AutoBackbone, AutoModel, AutoModelForImageClassification

    if kind == "classes":
        return AutoModelForImageClassification
    return AutoModel if type(config) in MODEL_MAPPING else AutoBackbone


def quieten_libraries(threads: int) -> None:
    """Import torch and transformers, say nothing, and use so many threads. Raises ImportError."""
    os.environ.setdefault("DISABLE_SAFETENSORS_CONVERSION", "1")  # asks the hub for one otherwise
    import torch
    from huggingface_hub.utils import logging as hub_logging
    from transformers.utils import logging as network_logging

    for log in (network_logging, hub_logging):
        log.set_verbosity_error()
    network_logging.disable_progress_bar()
    torch.set_num_threads(threads)

"""Finds networks of transformers by folder or name, and reads them.

A folder is read without any connection. A name is looked up in this machine's cache; only if it is
not there, the hub is asked once, before torch is imported or a download starts. Code that comes
with a network is never run. Weights are read from safetensors alone, and a network that lacks some
is refused, because transformers would fill in random ones.
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
from typing import Any

from hapticvlm import documents
from hapticvlm.errors import installing, short_line
from hapticvlm.vision.encoders.encoder import CARD, FINGERPRINT, EncoderError
from hapticvlm.vision.encoders.joint_embedding import is_imagenet
from hapticvlm.vision.encoders.preprocessing import PREPROCESSING

CONFIG = "config.json"
WEIGHTS = ".safetensors"
PICKLED = (".bin", ".pt", ".pth", ".ckpt", ".pkl", ".h5", ".msgpack")
LFS = b"version https://git-lfs"
CLASSIFIER = "ForImageClassification"
HUB_S = 10.0  # until the hub must have answered whether it has a network
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
        raise EncoderError(f"encoder `{name}` is a file; give the folder that holds it")
    if not path.is_dir():
        raise EncoderError(f"encoder `{name}` is not a folder; give one, or a name of the hub")
    if (path / CONFIG).is_file():
        return _require_preprocessing(path)
    inner = {file.parent.name for mark in (CONFIG, CARD) for file in path.glob(f"*/{mark}")}
    if inner:
        problem = f"encoder `{name}` is a folder of several networks"
        raise EncoderError(f"{problem}; give one of {', '.join(sorted(inner))}")
    problem = f"encoder `{name}` holds neither {CARD} nor {CONFIG}"
    raise EncoderError(f"{problem}; give the folder of one network")


@dataclass(frozen=True, slots=True)
class Network:
    """A network of transformers with its preprocessing.

    is_classifier: it has the classes of ImageNet. revision: of the hub, "" for a folder.
    """

    model: Any
    is_classifier: bool
    preprocessor: Mapping[str, Any]
    revision: str


def read(source: Path | str) -> Network:
    """Read the network that `find` returned, with its preprocessing. Raises EncoderError."""
    fault = fault_of(source) if isinstance(source, Path) else None
    if fault is not None:
        raise EncoderError(f"encoder `{source}` cannot be loaded ({fault}); {FOLDER}")
    try:
        network, missing = _load(source)
    except Exception as error:  # noqa: BLE001 - whatever a foreign file causes
        problem = f"encoder `{source}` cannot be loaded ({short_line(error)})"
        raise EncoderError(f"{problem}; {FOLDER}") from None
    lacking = sorted(key for key in missing if not key.startswith("pooler."))
    if lacking:
        problem = (
            f"encoder `{source}` lacks {len(lacking)} weights of its network, {lacking[0]} first"
        )
        raise EncoderError(f"{problem}; {FOLDER}")
    return network


def label(source: Path | str) -> str:
    """Return the name that galleries store; a folder's has a digest of its weights."""
    if isinstance(source, str):
        return source
    digest = hashlib.sha256()
    for path in sorted(source.iterdir()):
        if path.suffix == WEIGHTS:
            with documents.open_file(path) as file:
                digest.update(hashlib.file_digest(file, "sha256").digest())
    return f"{source.resolve().name}-{digest.hexdigest()[:FINGERPRINT]}"


def _require_preprocessing(folder: Path) -> Path:
    if not any((folder / name).is_file() for name in PREPROCESSING):
        problem = f"encoder `{folder}` has no {PREPROCESSING[0]}"
        raise EncoderError(f"{problem}; copy it there from the network it was trained from")
    return folder


def _require_reachable(name: str) -> None:
    """Ask the hub once for a network that is not cached; a download would retry for minutes."""
    try:
        import huggingface_hub
    except ImportError as error:
        problem = f"encoder `{name}` needs transformers ({error})"
        raise EncoderError(f"{problem}: {installing(PACKAGES)}") from None
    try:
        if not isinstance(huggingface_hub.try_to_load_from_cache(name, CONFIG), str):
            huggingface_hub.model_info(name, timeout=HUB_S)
            logger.warning("encoder `%s` is not on this machine: downloading it", name)
    except Exception as error:  # noqa: BLE001 - no network, no such name, no access, offline mode
        problem = f"encoder `{name}` is not a folder and cannot be downloaded ({short_line(error)})"
        raise EncoderError(f"{problem}; {FOLDER}") from None


def fault_of(folder: Path) -> str | None:
    """Return what is wrong with a network's folder, and its cure, in words; None: nothing seen.

    Files are looked at before a library reads them, whose errors name another cause. Needs
    transformers.
    """
    files = sorted(path for path in folder.iterdir() if path.is_file())
    names = [path.name for path in files]
    pickled = [name for name in names if name.endswith(PICKLED)]
    if pickled and not any(name.endswith(WEIGHTS) for name in names):
        problem = f"it has pickled weights ({pickled[0]}), which can run any code"
        return f"{problem} when they are read; save them as safetensors"
    # Of files of another content than their name says: the library names them.
    with suppress(OSError, ValueError, LookupError, TypeError, AttributeError):
        for file in files:
            with documents.open_file(file) as opened:
                head = opened.read(len(LFS))
            if head == LFS:
                return f"{file.name} is a pointer of git-LFS: run `git lfs pull` there"
            if file.suffix == WEIGHTS and (size := file.stat().st_size) < (whole := _size(file)):
                return f"{file.name} is cut, {size} of {whole} bytes: download it again"
            if file.name.endswith(f"{WEIGHTS}.index.json"):
                shards = documents.read_json(file, dict[str, Any])["weight_map"].values()
                if missing := sorted(set(shards) - set(names)):
                    return f"{missing[0]} is missing: download it again"
        return _fault_of_config(documents.read_json(folder / CONFIG, dict[str, Any]))
    return None


def _size(file: Path) -> int:
    """Return how many bytes a file of safetensors should have, by its head. Raises ValueError."""
    with documents.open_file(file) as opened:
        length = 8 + int.from_bytes(opened.read(8), "little")
        if length > file.stat().st_size:
            return length
        tensors = documents.parse_json(opened.read(length - 8))
    ends = [tensor["data_offsets"][1] for tensor in tensors.values() if "data_offsets" in tensor]
    return length + max(ends, default=0)


def _fault_of_config(config: Mapping[str, Any]) -> str | None:
    import transformers

    quantised = config.get("quantization_config") or {}
    if quantised.get("quant_method") == "fp8":
        return (
            "its weights are of 8-bit floats (fp8), which only some GPUs read: name the plain one"
        )
    if config.get("model_type", "") in ("", *transformers.CONFIG_MAPPING):
        return None
    if config.get("auto_map"):
        return "it needs its own code (auto_map), which is never run"
    kind = f"its type `{config['model_type']}`"
    return (
        f"transformers {transformers.__version__} does not know {kind}: pip install -U transformers"
    )


def _load(source: Path | str) -> tuple[Network, Iterable[str]]:
    """Read the network; also return the names of weights that it lacks."""
    if isinstance(source, Path):
        return _load_from(source, is_local=True)
    with suppress(OSError):
        return _load_from(source, is_local=True)
    return _load_from(source, is_local=False)


def _load_from(source: Path | str, *, is_local: bool) -> tuple[Network, Iterable[str]]:
    import torch
    from transformers import AutoConfig, BaseImageProcessor

    config = AutoConfig.from_pretrained(source, local_files_only=is_local, trust_remote_code=False)
    preprocessor, _ = BaseImageProcessor.get_image_processor_dict(source, local_files_only=is_local)
    is_classifier = _is_classifier(config)
    model, info = _loader(config, is_classifier=is_classifier).from_pretrained(
        source,
        config=config,
        dtype=torch.float32,
        local_files_only=is_local,
        use_safetensors=True,
        output_loading_info=True,
        trust_remote_code=False,
    )
    # Of a network of pictures and text (CLIP, SigLIP) only the half that sees is of use.
    model = getattr(model, "vision_model", model)
    revision = getattr(config, "_commit_hash", None) or ""
    return Network(model.eval(), is_classifier, preprocessor, revision), info["missing_keys"]


def _is_classifier(config: Any) -> bool:  # noqa: ANN401 - transformers is untyped
    """Whether a network has the classes of ImageNet."""
    classifies = any(str(a).endswith(CLASSIFIER) for a in config.architectures or ())
    return classifies and is_imagenet(config.num_labels, config.id2label)


def _loader(config: Any, *, is_classifier: bool) -> Any:  # noqa: ANN401
    """Choose the class of transformers that loads it."""
    from transformers import MODEL_MAPPING, AutoBackbone, AutoModel, AutoModelForImageClassification

    if is_classifier:
        return AutoModelForImageClassification
    return AutoModel if type(config) in MODEL_MAPPING else AutoBackbone


def quieten_libraries(threads: int) -> None:
    """Import torch and transformers, silence them, set torch's threads. Raises ImportError."""
    os.environ.setdefault("DISABLE_SAFETENSORS_CONVERSION", "1")  # asks the hub for one otherwise
    import torch
    from huggingface_hub.utils import logging as hub_logging
    from transformers.utils import logging as network_logging

    for log in (network_logging, hub_logging):
        log.set_verbosity_error()
    network_logging.disable_progress_bar()
    torch.set_num_threads(threads)

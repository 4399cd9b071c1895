"""Finds networks of transformers by folder or name, and reads them.

A folder is read without any connection. A name is looked up in this machine's cache; only if it is
not there, the hub is asked once, before a download starts. Code that comes with a network is never
run. Weights are read from safetensors alone, and a network that lacks some is refused, because
transformers would fill in random ones.
"""

from __future__ import annotations

import hashlib
import logging
import os
import re
from collections.abc import Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
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
# What is taken from the hub: not the copies of the weights in other precisions (model.fp16 ...).
FILES = ("*.json", f"model{WEIGHTS}", f"model-*-of-*{WEIGHTS}", "*.txt", "*.jinja", "*.model")
FOLDER = "give a whole folder that save_pretrained wrote"
# OpenMP threads that spin while they wait take the cores from the gateway and from each other: with
# a third busy process on two cores a pass of a vision-language model took eight times as long.
PASSIVE = {"OMP_WAIT_POLICY": "PASSIVE", "GOMP_SPINCOUNT": "0"}
logger = logging.getLogger(__name__)


def find(what: str, name: str) -> Path | None:
    """Return a network's folder; None for a name of the hub. Imports no library.

    what: the network in the words of an error. Raises EncoderError.
    """
    path = Path(name).expanduser()
    if (path / CONFIG).is_file():
        return path
    inner = {file.parent.name for mark in (CONFIG, CARD) for file in path.glob(f"*/{mark}")}
    if inner:
        problem = f"{what} is a folder of several networks"
        raise EncoderError(f"{problem}; give one of {', '.join(sorted(inner))}")
    if path.is_dir():
        raise EncoderError(f"{what} has no {CONFIG}; {FOLDER}")
    if path.exists() or not HUB_NAME.fullmatch(name):
        raise EncoderError(f"{what} is not a folder; {FOLDER}, or a name of the hub")
    return None


def from_hub(what: str, name: str) -> Path:
    """Return the folder of a network of the hub, whose name is its commit. Raises EncoderError."""
    import huggingface_hub

    # The same patterns twice, or a copy of just these files would count as incomplete.
    download = partial(huggingface_hub.snapshot_download, name, allow_patterns=list(FILES))
    with suppress(Exception):  # not in the cache; the library has several errors for it
        folder = Path(download(local_files_only=True))
        if any(folder.glob(f"*{WEIGHTS}")):
            return folder
    try:
        huggingface_hub.model_info(name, timeout=HUB_S)  # a download would retry for minutes
        logger.warning("%s is not on this machine: downloading it", what)
        return Path(download())
    except Exception as error:  # noqa: BLE001 - no network, no such name, no access, offline mode
        problem = f"{what} is not a folder and cannot be downloaded ({short_line(error)})"
        raise EncoderError(f"{problem}; {FOLDER}") from None


def set_up(what: str, device: str, threads: int) -> str:
    """Import torch and transformers, silence them, set torch's threads; return the device to use.

    Raises EncoderError.
    """
    os.environ.setdefault("DISABLE_SAFETENSORS_CONVERSION", "1")  # asks the hub for one otherwise
    for name, value in {**PASSIVE, "OMP_NUM_THREADS": str(threads)}.items():
        os.environ.setdefault(name, value)  # read by OpenMP when torch is imported
    try:
        import torch
        from huggingface_hub.utils import logging as hub_logging
        from transformers.utils import logging as network_logging
    except ImportError as error:
        problem = f"{what} needs torch and transformers ({error})"
        raise EncoderError(f"{problem}: {installing(PACKAGES)}") from None
    for log in (network_logging, hub_logging):
        log.set_verbosity_error()
    network_logging.disable_progress_bar()
    torch.set_num_threads(threads)
    has_cuda = torch.cuda.is_available()
    if device == "cuda" and not has_cuda:
        problem = f"{what}: torch finds no CUDA device here"
        raise EncoderError(f"{problem}; use cpu, or install the torch that fits the GPU")
    return "cuda" if has_cuda and device != "cpu" else "cpu"


@dataclass(frozen=True, slots=True)
class Network:
    """A network of transformers with its preprocessing.

    is_classifier: it has the classes of ImageNet.
    """

    model: Any
    is_classifier: bool
    preprocessor: Mapping[str, Any]


def read(what: str, folder: Path) -> Network:
    """Read the network of a folder, with its preprocessing. Raises EncoderError."""
    if fault := fault_of(folder):
        raise EncoderError(f"{what} cannot be loaded ({fault}); {FOLDER}")
    try:
        network, missing = _load(folder)
    except Exception as error:  # noqa: BLE001 - whatever a foreign file causes
        raise EncoderError(f"{what} cannot be loaded ({short_line(error)}); {FOLDER}") from None
    lacking = sorted(key for key in missing if not key.startswith("pooler."))
    if lacking:
        problem = f"{what} lacks {len(lacking)} weights of its network, {lacking[0]} first"
        raise EncoderError(f"{problem}; {FOLDER}")
    return network


def label(folder: Path) -> str:
    """Return the name under which galleries store a folder's network, with a digest of weights."""
    digest = hashlib.sha256()
    for path in sorted(folder.iterdir()):
        if path.suffix == WEIGHTS:
            with documents.open_file(path) as file:
                digest.update(hashlib.file_digest(file, "sha256").digest())
    return f"{folder.resolve().name}-{digest.hexdigest()[:FINGERPRINT]}"


def fault_of(folder: Path) -> str | None:
    """Return what is wrong with a network's folder, and its cure, in words; None: nothing seen.

    Files are looked at before a library reads them, whose errors name another cause. Needs
    transformers.
    """
    files = sorted(path for path in folder.iterdir() if path.is_file())
    names = [path.name for path in files]
    if not set(PREPROCESSING) & set(names):
        return f"{PREPROCESSING[0]} is missing: copy it from the network it was trained from"
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


def _load(folder: Path) -> tuple[Network, Iterable[str]]:
    """Read the network; also return the names of weights that it lacks."""
    import torch
    from transformers import AutoConfig, BaseImageProcessor

    here = {"local_files_only": True}
    config = AutoConfig.from_pretrained(folder, **here, trust_remote_code=False)
    preprocessor, _ = BaseImageProcessor.get_image_processor_dict(folder, **here)
    is_classifier = _is_classifier(config)
    model, info = _loader(config, is_classifier=is_classifier).from_pretrained(
        folder,
        config=config,
        dtype=torch.float32,
        use_safetensors=True,
        output_loading_info=True,
        trust_remote_code=False,
        **here,
    )
    # Of a network of pictures and text (CLIP, SigLIP) only the half that sees is of use.
    model = getattr(model, "vision_model", model)
    return Network(model.eval(), is_classifier, preprocessor), info["missing_keys"]


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

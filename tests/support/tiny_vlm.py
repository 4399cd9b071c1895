"""A Qwen2-VL of the real architecture, small enough to build in a test, in a folder of its own."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import random_vlm
from numpy.typing import NDArray

from hapticvlm import materials
from hapticvlm.vlm import contract
from hapticvlm.vlm.local import LocalVlm

if TYPE_CHECKING:
    import torch

Pixels = NDArray[np.uint8]

ASKED = (
    contract.about_ambient(),
    contract.about_material(tuple(materials.MATERIALS)),
)
SD = 0.15  # of the weights: with the usual 0.02 an answer hangs on its last token alone
SPLIT = ("ceramic", "foliage")  # names that the tokenizer is to know in parts only


def write_tiny_vlm(folder: Path, seed: int = 0) -> Path:
    """Write network (float32), tokenizer, chat template and image processor; takes a second."""
    texts = " ".join(text for asked in ASKED for text in (asked.instruction, *asked.questions))
    for name in SPLIT:
        texts = texts.replace(name, "")
    random_vlm.write(folder, [texts], seed, SD)
    return folder


def picture(seed: int = 0, height: int = 90, width: int = 160) -> Pixels:
    """Draw a picture of random blocks: (height, width, 3) uint8."""
    blocks = np.random.default_rng(seed).integers(0, 255, (height // 10, width // 10, 3), np.uint8)
    large: Pixels = np.kron(blocks, np.ones((10, 10, 1), np.uint8))
    return large


def rewrite(folder: Path, change: Callable[[str, torch.Tensor], torch.Tensor | None]) -> None:
    """Change the weights in a folder; None leaves one out."""
    from safetensors.torch import load_file, save_file

    file = folder / "model.safetensors"
    changed = {name: change(name, tensor) for name, tensor in load_file(file).items()}
    kept = {name: tensor for name, tensor in changed.items() if tensor is not None}
    save_file(kept, file, {"format": "pt"})


@contextmanager
def planting(vlm: LocalVlm, *texts: str, share: float = 1.0) -> Iterator[None]:
    """Make a network answer with a text and its end, one each wording, whatever it is shown.

    share: probability of the first token; the rest is that of a word that begins a sentence. What
    was answered so far is what each row sees behind the prompt, so a wrong mask shows.
    """
    end = vlm.network.model.generation_config.eos_token_id
    answers = [[*vlm.chat.encode(text), end] for text in texts]
    filler = vlm.chat.encode("What")[0]
    begun: list[list[int]] = []

    def look(_module: object, _inputs: object, given: dict[str, Any]) -> None:
        ids, mask = given["input_ids"][0], given.get("attention_mask")
        if mask is None:
            begun[:] = []
            return
        seen = [ids[mask[0, 0, row, -len(ids) :] == 0] for row in given["logits_to_keep"]]
        begun[:] = [_answered(vlm, row.tolist()) for row in seen]

    def speak(_module: object, _inputs: object, outputs: Any) -> None:
        for row, text in enumerate(begun):
            answer = answers[row * len(answers) // len(begun)]
            is_on_its_way = text == answer[: len(text)] and len(text) < len(answer)
            outputs.logits[0, row] = -40.0
            outputs.logits[0, row, answer[len(text)] if is_on_its_way else end] = 40.0
            if not text and share < 1.0:
                outputs.logits[0, row, filler] = 40.0 + math.log(1.0 / share - 1.0)

    model = vlm.network.model
    hooks = [
        model.register_forward_pre_hook(look, with_kwargs=True),
        model.register_forward_hook(speak),
    ]
    try:
        yield
    finally:
        for hook in hooks:
            hook.remove()


def _answered(vlm: LocalVlm, seen: list[int]) -> list[int]:
    opening = vlm.chat.encode("<|im_start|>assistant\n")
    starts = [at for at in range(len(seen)) if seen[at : at + len(opening)] == opening]
    return seen[starts[-1] + len(opening) :]

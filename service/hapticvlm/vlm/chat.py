"""From an instruction, pictures and questions to the tokens and tensors of a chat model.

The template is rendered by the tokenizer, pictures are prepared by the model's own image processor.
For models of the Qwen-VL family the image placeholders are repeated here, so that neither the
library's whole processor nor torchvision is needed; others go through their own processor. Knows no
network.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from hapticvlm.vision.encoders.networks import short_line
from hapticvlm.vlm.contract import Asked, Picture, VlmError


@dataclass(frozen=True, slots=True)
class Prompt:
    """One question about pictures in K wordings, split where what they share ends.

    head: before the first picture, the same for every picture. body: pictures and what else all
    wordings share. tails: what is left of each wording, one token or more. tensors: of the
    pictures, as the network takes them.
    """

    head: tuple[int, ...]
    body: tuple[int, ...]
    tails: tuple[tuple[int, ...], ...]
    tensors: Mapping[str, Any]


@dataclass(frozen=True, slots=True)
class Chat:
    """A model's tokenizer with what prepares its pictures, and the token that stands for one.

    `processor` is the model's whole processor where `images` alone cannot give how many tokens a
    picture becomes, else None.
    """

    tokenizer: Any
    images: Any
    processor: Any
    image_id: int

    def prompt(self, asked: Asked, pictures: Sequence[Picture]) -> Prompt:
        """Build the question on pictures (H, W, 3) uint8. Raises VlmError."""
        try:
            wholes, tensors = self._wholes(asked, _as_images(pictures))
        except VlmError:
            raise
        except Exception as error:  # noqa: BLE001 - whatever a foreign template or picture trips
            text = f"the model's chat template or image processor fails ({short_line(error)})"
            raise VlmError(text) from None
        return split(wholes, self.image_id, tensors)

    def encode(self, text: str) -> list[int]:
        """Return the tokens of an answer's text."""
        tokens: list[int] = self.tokenizer.encode(text, add_special_tokens=False)
        return tokens

    def _wholes(
        self, asked: Asked, images: Sequence[Any]
    ) -> tuple[list[list[int]], Mapping[str, Any]]:
        texts = [
            self._render(asked.instruction, question, len(images)) for question in asked.questions
        ]
        if self.processor is None:
            return self._by_grid(texts, images)
        return self._by_processor(texts, images)

    def _render(self, instruction: str, question: str, pictures: int) -> str:
        content = [
            {"type": "text", "text": instruction},
            *({"type": "image"} for _ in range(pictures)),
            {"type": "text", "text": question},
        ]
        renderer = self.processor if self.processor is not None else self.tokenizer
        text: str = renderer.apply_chat_template(
            [{"role": "user", "content": content}], tokenize=False, add_generation_prompt=True
        )
        return text

    def _by_grid(
        self, texts: Sequence[str], images: Sequence[Any]
    ) -> tuple[list[list[int]], Mapping[str, Any]]:
        """Repeat each placeholder as often as its picture's grid has merged cells."""
        tensors = self.images(images=images, return_tensors="pt")
        cells = self.images.merge_size**2
        counts = [int(grid.prod()) // cells for grid in tensors["image_grid_thw"]]
        wholes = []
        for text in texts:
            plain = self.encode(text)
            if plain.count(self.image_id) != len(counts):
                raise VlmError("the model's chat template has no place for pictures")
            left = iter(counts)
            wholes.append(
                [id for t in plain for id in [t] * (next(left) if t == self.image_id else 1)]
            )
        return wholes, dict(tensors)

    def _by_processor(
        self, texts: Sequence[str], images: Sequence[Any]
    ) -> tuple[list[list[int]], Mapping[str, Any]]:
        wholes: list[list[int]] = []
        tensors: dict[str, Any] = {}
        for text in texts:
            tensors = dict(self.processor(text=[text], images=[images], return_tensors="pt"))
            wholes.append(tensors.pop("input_ids")[0].tolist())
            if self.image_id not in wholes[-1]:
                raise VlmError("the model's chat template has no place for pictures")
            for name in ("attention_mask", "token_type_ids", "mm_token_type_ids"):
                tensors.pop(name, None)
        return wholes, tensors


def split(wholes: Sequence[Sequence[int]], image_id: int, tensors: Mapping[str, Any]) -> Prompt:
    """Split wordings that differ only behind their last image token."""
    first = wholes[0].index(image_id)
    shared = 0
    for tokens in zip(*wholes, strict=False):
        if len(set(tokens)) > 1:
            break
        shared += 1
    shared = min(shared, *(len(whole) - 1 for whole in wholes))
    if any(image_id in whole[shared:] for whole in wholes):
        raise VlmError("the wordings differ before the picture")
    return Prompt(
        head=tuple(wholes[0][:first]),
        body=tuple(wholes[0][first:shared]),
        tails=tuple(tuple(whole[shared:]) for whole in wholes),
        tensors=tensors,
    )


def _as_images(pictures: Sequence[Picture]) -> list[Any]:
    from PIL import Image

    return [Image.fromarray(picture) for picture in pictures]

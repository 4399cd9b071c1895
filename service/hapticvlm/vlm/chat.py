"""Turns an instruction, pictures and questions into the tokens and tensors of a chat model.

The tokenizer renders the chat template, and the model's own image processor prepares the pictures.
For models of the Qwen-VL family the image placeholders are repeated here, so that neither the
library's whole processor nor torchvision is needed; other models use their own processor. Knows no
network.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from hapticvlm.errors import short_line
from hapticvlm.vlm.contract import Picture, QuestionText, VlmError


@dataclass(frozen=True, slots=True)
class Prompt:
    """A question about pictures in K wordings, as tokens, split where the wordings differ.

    head: tokens before the first picture, the same for all pictures. body: the pictures and all
    further tokens that the wordings share. tails: the remaining tokens of each wording, at least
    one. tensors: the pictures, as the network takes them.
    """

    head: tuple[int, ...]
    body: tuple[int, ...]
    tails: tuple[tuple[int, ...], ...]
    tensors: Mapping[str, Any]


@dataclass(frozen=True, slots=True)
class Chat:
    """A model's tokenizer and image processor, and the id of the token that stands for a picture.

    `processor` is the model's whole processor, where `images` alone cannot tell how many tokens a
    picture becomes; else None.
    """

    tokenizer: Any
    images: Any
    processor: Any
    image_id: int

    def prompt(self, question: QuestionText, pictures: Sequence[Picture]) -> Prompt:
        """Build the prompt about pictures (H, W, 3) uint8. Raises VlmError."""
        try:
            wholes, tensors = self._wholes(question, _as_images(pictures))
        except VlmError:
            raise
        except Exception as error:  # noqa: BLE001 - whatever a foreign template or picture causes
            reason = short_line(error)
            raise VlmError(
                f"the model's chat template or image processor fails ({reason})"
            ) from None
        return split(wholes, self.image_id, tensors)

    def encode(self, text: str) -> list[int]:
        """Return the tokens of a text."""
        tokens: list[int] = self.tokenizer.encode(text, add_special_tokens=False)
        return tokens

    def _wholes(
        self, question: QuestionText, images: Sequence[Any]
    ) -> tuple[list[list[int]], Mapping[str, Any]]:
        texts = [
            self._render(question.instruction, wording, len(images))
            for wording in question.questions
        ]
        if self.processor is None:
            return self._by_grid(texts, images)
        return self._by_processor(texts, images)

    def _render(self, instruction: str, wording: str, pictures: int) -> str:
        content = [
            {"type": "text", "text": instruction},
            *({"type": "image"} for _ in range(pictures)),
            {"type": "text", "text": wording},
        ]
        renderer = self.processor if self.processor is not None else self.tokenizer
        text: str = renderer.apply_chat_template(
            [{"role": "user", "content": content}], tokenize=False, add_generation_prompt=True
        )
        return text

    def _by_grid(
        self, texts: Sequence[str], images: Sequence[Any]
    ) -> tuple[list[list[int]], Mapping[str, Any]]:
        """Repeat each image token by the number of merged cells in its picture's grid."""
        tensors = self.images(images=images, return_tensors="pt")
        cells = self.images.merge_size**2
        counts = [int(grid.prod()) // cells for grid in tensors["image_grid_thw"]]
        wholes = []
        for text in texts:
            plain = self.encode(text)
            if plain.count(self.image_id) != len(counts):
                raise VlmError("the model's chat template does not take pictures")
            left = iter(counts)
            wholes.append(
                [
                    id
                    for token in plain
                    for id in [token] * (next(left) if token == self.image_id else 1)
                ]
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
                raise VlmError("the model's chat template does not take pictures")
            for name in ("attention_mask", "token_type_ids", "mm_token_type_ids"):
                tensors.pop(name, None)
        return wholes, tensors


def split(wholes: Sequence[Sequence[int]], image_id: int, tensors: Mapping[str, Any]) -> Prompt:
    """Split wordings that differ only after their last image token. Raises VlmError."""
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

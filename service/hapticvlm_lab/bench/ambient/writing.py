"""The slower method that readouts are charted against: the model writes a sentence, which is read.

As the library's own `generate` writes it, from one wording; so its time is what a user of the
library would wait. Nothing in the service asks this way.
"""

from __future__ import annotations

import inspect
import time
from dataclasses import replace
from typing import Any

from hapticvlm.evidence.reading import Reading
from hapticvlm.vlm.chat import Prompt
from hapticvlm.vlm.contract import Picture, about_ambient, widened
from hapticvlm.vlm.limits import ANSWER_TOKENS
from hapticvlm.vlm.local import LocalVlm
from hapticvlm.vlm.network import guarded
from hapticvlm.vlm.sentence import read_celsius


class WritingVlm(LocalVlm):
    """A model in process that is asked for a sentence."""

    def __init__(self, vlm: LocalVlm) -> None:
        super().__init__(vlm.network, vlm.chat, vlm.name)

    def ambient(self, picture: Picture) -> Reading:
        """Read the ambient temperature off a picture (H, W, 3) uint8 RGB. Raises VlmError."""
        start = time.monotonic()
        asked = about_ambient()
        prompt = self.chat.prompt(replace(asked, questions=asked.questions[:1]), [picture])
        stated = read_celsius(self._written(prompt))
        low_c, high_c = widened(stated.value_c, stated.low_c, stated.high_c)
        return Reading(stated.value_c, low_c, high_c, None, "text", time.monotonic() - start)

    def _written(self, prompt: Prompt) -> str:
        import torch

        model = self.network.model
        ids = torch.tensor([[*prompt.head, *prompt.body, *prompt.tails[0]]], device=model.device)
        given: dict[str, Any] = {
            name: tensor.to(model.device, model.dtype if tensor.is_floating_point() else None)
            for name, tensor in prompt.tensors.items()
        }
        if "mm_token_type_ids" in inspect.signature(model.forward).parameters:
            given["mm_token_type_ids"] = (ids == self.chat.image_id).int()
        with guarded("the model's answer"):
            whole = model.generate(
                input_ids=ids,
                attention_mask=torch.ones_like(ids),
                do_sample=False,
                max_new_tokens=ANSWER_TOKENS,
                **given,
            )
        text: str = self.chat.tokenizer.decode(whole[0, ids.shape[1] :], skip_special_tokens=True)
        return text

"""The OpenAI chat protocol: what a question looks like on the wire, and an answer. Pure.

vLLM, `transformers serve` and others speak it. The instruction comes before the pictures, so that
an endpoint which caches prefixes computes it once.
"""

from __future__ import annotations

import base64
import math
from collections.abc import Sequence

import numpy as np

from hapticvlm.recognition.vlm.answers import Picture
from hapticvlm.recognition.vlm.endpoint import EndpointError, Json
from hapticvlm.recognition.vlm.generation import MOST_TOKENS
from hapticvlm.recognition.vlm.logprobs import TOP
from hapticvlm.recognition.vlm.prompts import Asked

QUALITY = 90  # of the JPEG
TOKEN_SIDE = 28  # px of a picture that become one token: Qwen2-VL's patches of 14, merged 2 x 2


def question(asked: Asked, wording: int, pictures: Sequence[Picture], image_tokens: int) -> Json:
    """Word a question about pictures (H, W, 3) uint8 RGB, each shrunk to its token budget."""
    content: list[Json] = [{"type": "text", "text": asked.instruction}]
    content += [_shown(shrink(picture, image_tokens)) for picture in pictures]
    content.append({"type": "text", "text": asked.questions[wording]})
    return {
        "messages": [{"role": "user", "content": content}],
        "max_tokens": MOST_TOKENS,
        "temperature": 0.0,
        "stream": False,
    }


def with_logprobs(body: Json) -> Json:
    """Ask for log-probabilities too."""
    return body | {"logprobs": True, "top_logprobs": TOP}


def first_choice(answer: Json) -> Json:
    """Take the answer's one choice. Raises EndpointError."""
    choices = answer.get("choices")
    first = choices[0] if isinstance(choices, list) and choices else None
    if not isinstance(first, dict):
        raise EndpointError("the endpoint's answer has no choices: is it a chat endpoint?")
    return first


def text_of(choice: Json) -> str:
    """Take a choice's text. Raises EndpointError."""
    message = choice.get("message")
    text = message.get("content") if isinstance(message, dict) else None
    if not isinstance(text, str):
        raise EndpointError("the endpoint's answer has no text")
    return text


def model_names(answer: Json) -> list[str]:
    """List the models that an endpoint says it has; [] where it says it in no known form."""
    listed = answer.get("data")
    if not isinstance(listed, list):
        return []
    names = [one.get("id") for one in listed if isinstance(one, dict)]
    return [name for name in names if isinstance(name, str)]


def shrink(picture: Picture, image_tokens: int) -> Picture:
    """Shrink a picture (H, W, 3) uint8 to about the pixels of its budget; never enlarge it."""
    from PIL import Image

    height, width = picture.shape[:2]
    scale = math.sqrt(image_tokens * TOKEN_SIDE**2 / (height * width))
    if scale >= 1.0:
        return picture
    size = max(1, round(width * scale)), max(1, round(height * scale))
    return np.asarray(Image.fromarray(picture).resize(size, Image.Resampling.BICUBIC))


def _shown(picture: Picture) -> Json:
    import simplejpeg

    data = simplejpeg.encode_jpeg(np.ascontiguousarray(picture), quality=QUALITY)
    url = f"data:image/jpeg;base64,{base64.b64encode(data).decode()}"
    return {"type": "image_url", "image_url": {"url": url}}

"""Writes questions and reads answers in the OpenAI chat protocol. Pure.

vLLM, `transformers serve` and others use it. The instruction comes before the pictures, so that
an endpoint which caches prefixes computes it once. An answer is read from its text, as the paper's
answers were.
"""

from __future__ import annotations

import base64
import math
import re
from collections.abc import Collection, Sequence

import numpy as np

from hapticvlm.evidence.ladder import Evidence, decide
from hapticvlm.evidence.names import from_name
from hapticvlm.evidence.reading import Reading
from hapticvlm.http_client import printable
from hapticvlm.materials import UNKNOWN
from hapticvlm.vlm.answer_text import ThoughtError, UnreadError, answer_text, is_cut, unmarked
from hapticvlm.vlm.contract import Picture, QuestionText, widened
from hapticvlm.vlm.endpoint import EndpointError, Json
from hapticvlm.vlm.limits import ANSWER_TOKENS, TEXT_BELIEF, THINKING_TOKENS
from hapticvlm.vlm.sentence import Stated, read_celsius

TOKEN_SIDE = 28  # px of a picture that become one token: Qwen2-VL's patches of 14, merged 2 x 2
LEAST_SIDE, MOST_ASPECT = 2 * TOKEN_SIDE, 50  # px; longer sides for each px of the shorter
QUALITY = 90  # of the JPEG
# Parameters that some endpoints refuse: the newest models take `max_completion_tokens` instead of
# `max_tokens` and set the temperature themselves, small contexts have no room for a thought.
LIMITS = ("max_tokens", "max_completion_tokens")
PARAMETERS = ("reasoning_effort", *LIMITS, "temperature")
# A server that refuses "unexpected fields" by one of these names none of them.
REFUSING = (400, 422, 501)
# An error of these is not about a parameter: token, money, address, size, pace.
NOT_THE_QUESTION = (401, 402, 403, 404, 413, 429)
SHORT_WORDS = 3  # of an answer that is a name
_DENIALS = frozenset({"not", "no", "never", "isn", "neither", "nor"})


def question(
    about: QuestionText, wording: int, pictures: Sequence[Picture], image_tokens: int
) -> Json:
    """Return the body of a request about pictures (H, W, 3) uint8 RGB, fitted to the budget."""
    content: list[Json] = [{"type": "text", "text": about.instruction}]
    content += [_image_part(fitted(picture, image_tokens)) for picture in pictures]
    content.append({"type": "text", "text": about.questions[wording]})
    return {
        "messages": [{"role": "user", "content": content}],
        "max_tokens": ANSWER_TOKENS,
        "temperature": 0.0,
        "stream": False,
    }


def thinking(body: Json) -> Json:
    """Return a body for a model that thinks first: without a thought where it can, or with room."""
    return {**body, "max_tokens": THINKING_TOKENS, "reasoning_effort": "none"}


def again(body: Json, briefly: str) -> Json:
    """Return the same question with a demand for a brief answer.

    The answer that could not be read is not repeated to the model: of "below 10" a brief answer
    would be 10.
    """
    (turn,) = body["messages"]
    demand = {"type": "text", "text": briefly}
    return {**body, "messages": [{**turn, "content": [*turn["content"], demand]}]}


def without(body: Json, refused: Collection[str]) -> Json:
    """Return a body without those of PARAMETERS that the endpoint refuses."""
    kept = {name: value for name, value in body.items() if name not in refused}
    if "max_tokens" in refused and "max_completion_tokens" not in refused:
        kept["max_completion_tokens"] = THINKING_TOKENS
    return kept


def refused_parameters(body: Json, error: EndpointError) -> frozenset[str]:
    """Return what to ask without after an error: the one of PARAMETERS that it names.

    A refusal that names none is taken to be of the least usual one. Empty if the error is about
    something else, or if nothing can be left out.
    """
    if error.status in NOT_THE_QUESTION or error.wait_s is not None:
        return frozenset()
    for name in PARAMETERS:
        if error.status is not None and name in body and name in str(error):
            return frozenset({name})
    is_refusal = error.status in REFUSING
    return frozenset({"reasoning_effort"} & body.keys()) if is_refusal else frozenset()


def first_choice(answer: Json) -> Json:
    """Return the answer's one choice. Raises EndpointError."""
    choices = answer.get("choices")
    first = choices[0] if isinstance(choices, list) and choices else None
    if not isinstance(first, dict):
        raise EndpointError("the endpoint's answer has no choices; is it a chat endpoint?")
    return first


def model_names(answer: Json) -> list[str]:
    """List the models that an endpoint offers; [] if the list has another form."""
    listed = answer.get("data")
    if not isinstance(listed, list):
        return []
    names = [model.get("id") for model in listed if isinstance(model, dict)]
    return [name for name in names if isinstance(name, str)]


def fitted(picture: Picture, image_tokens: int) -> Picture:
    """Return a picture (H, W, 3) uint8 in a size that models take, of about its budget of tokens.

    The shorter side is enlarged to LEAST_SIDE and a strip is cut to its middle, MOST_ASPECT long.
    Models of Qwen's family refuse, or crash at, sides below 28 px and strips beyond 1 : 200.
    """
    from PIL import Image

    most = MOST_ASPECT * min(picture.shape[:2])
    top, left = (max(0, side - most) // 2 for side in picture.shape[:2])
    middle = picture[top : top + most, left : left + most]
    height, width = middle.shape[:2]
    scale = min(1.0, math.sqrt(image_tokens * TOKEN_SIDE**2 / (height * width)))
    scale = max(scale, LEAST_SIDE / min(height, width))
    if scale == 1.0:
        return middle
    size = round(width * scale), round(height * scale)
    return np.asarray(Image.fromarray(middle).resize(size, Image.Resampling.BICUBIC))


def _image_part(picture: Picture) -> Json:
    import simplejpeg

    data = simplejpeg.encode_jpeg(np.ascontiguousarray(picture), quality=QUALITY)
    url = f"data:image/jpeg;base64,{base64.b64encode(data).decode()}"
    return {"type": "image_url", "image_url": {"url": url}}


def stated_temperature(choice: Json) -> Stated:
    """Read the temperature that a choice's text states. Raises EndpointError.

    Of an answer that was cut off a number counts only with its unit: "2" may be the begin of "22".
    """
    try:
        stated = read_celsius(answer_text(choice))
    except UnreadError as error:
        raise ThoughtError(f"{error} (cut off)") if is_cut(choice) else error from None
    if is_cut(choice) and not stated.has_unit:
        raise ThoughtError("the model's answer is cut off behind a number")
    return stated


def ambient(stated: Sequence[Stated], seconds: float) -> Reading:
    """Read a temperature from what the answers to all wordings state.

    The interval encloses those of all wordings.
    """
    values = [one.value_c for one in stated]
    deviation = float(np.std(values, ddof=1)) if len(values) > 1 else None
    intervals = [widened(one.value_c, one.low_c, one.high_c) for one in stated]
    lows, highs = zip(*intervals, strict=True)
    return Reading(float(np.mean(values)), min(lows), max(highs), deviation, "text", seconds)


def material(choice: Json, names: Sequence[str]) -> Evidence:
    """Read the belief in a material from a choice's text.

    It must name one material, or say unknown. A short text may name it in a word of its own, as
    the name of an object does: oak, cloth. Raises EndpointError.
    """
    text = unmarked(answer_text(choice))
    words = re.findall(r"\w+", text.lower())
    named = [name for name in (*names, UNKNOWN) if name.lower() in words]
    if not named and len(words) <= SHORT_WORDS:
        named = [name for name in (_named_by(text),) if name in names]
    if len(named) != 1 or _DENIALS & set(words):
        raise UnreadError(f"the model's answer names no material or several: `{printable(text)}`")
    return Evidence("vlm", () if named == [UNKNOWN] else ((named[0], TEXT_BELIEF),))


def _named_by(text: str) -> str:
    evidence = from_name(text)
    return UNKNOWN if evidence is None else decide([evidence]).material

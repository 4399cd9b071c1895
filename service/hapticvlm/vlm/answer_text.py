"""Extracts what a chat model answers from its choice. Pure.

Models wrap an answer in ways of their own. Some think first, between tags, in a channel or in a
field of the message; some mark an answer by special tokens, a box, a code fence or emphasis; some
endpoints give the text in parts, or in the field of the thought. What is left is the answer itself,
which sentence.py and chat_protocol.py read.
"""

from __future__ import annotations

import re

from hapticvlm.http_client import printable
from hapticvlm.vlm.endpoint import EndpointError, Json

# Marks that end a thought; what precedes the last one is not the answer, even without its begin.
_THOUGHT_ENDS = re.compile(
    r"</(?:think|thinking|thought|reasoning)>|\[/THINK\]|<\|channel\|>final<\|message\|>",
    re.IGNORECASE,
)
_THOUGHT_BEGINS = re.compile(
    r"<(?:think|thinking|thought|reasoning)>|\[THINK\]|<\|channel\|>(?:analysis|commentary)",
    re.IGNORECASE,
)
_THOUGHT_FIELDS = ("reasoning_content", "reasoning", "thinking")
_THOUGHT_PARTS = ("thinking", "reasoning", "redacted_thinking")
# Reasons for which an answer ended by itself; None and "" from endpoints that give none.
_WHOLE = (
    None,
    "",
    "stop",
    "eos",
    "eos_token",
    "stop_sequence",
    "end_turn",
    "complete",
    "completed",
)
_CUT = ("length", "max_tokens")
BRIEF = 24  # characters of an answer in the field of the thought; a longer text is a thought
_FENCE = re.compile(r"```[a-z]*")
_SPECIAL = re.compile(r"<\|[^<>|]{1,40}\|>|</?[a-z_]{1,20}>|[ĠĊ▁]", re.IGNORECASE)
_BOX = re.compile(r"\\boxed\s*\{([^{}]*)\}")
_LATEX_TEXT = re.compile(r"\\(?:text|mathrm)\s*\{([^{}]*)\}")
_LATEX_DEGREE = re.compile(r"\^?\s*\{?\s*\\(?:circ|degree)\b\s*\}?")
_MARKUP = re.compile(r"[$`*]|\\[,;!()\[\] ]")


class UnreadError(EndpointError):
    """The model answered, but nothing that can be read; it may be asked once more."""


class ThoughtError(UnreadError):
    """The model's tokens ended before its answer did, as those of a model that thinks first."""


def is_cut(choice: Json) -> bool:
    """Whether an answer ended because its tokens did."""
    return str(choice.get("finish_reason")).lower() in _CUT


def answer_text(choice: Json) -> str:
    """Return the text of a choice's answer, without thoughts; its marks are left.

    Raises ThoughtError if it has only a thought, UnreadError if it is empty, EndpointError if the
    endpoint ended it.
    """
    message = choice.get("message", choice)  # completions have their text in the choice
    fields = message if isinstance(message, dict) else {}
    _require_ended_by_itself(choice, fields)
    written = _written(fields.get("content", fields.get("text")))
    answer = _THOUGHT_BEGINS.split(_THOUGHT_ENDS.split(written or "")[-1])[0]
    if answer.strip():
        return answer
    thought = next((str(fields[name]) for name in _THOUGHT_FIELDS if fields.get(name)), "")
    if 0 < len(thought) <= BRIEF and not written and not is_cut(choice):
        return thought  # some servers put the answer there once the thought is off
    if thought or written or (fields and is_cut(choice)):
        raise ThoughtError("the model thinks first and gave no answer within its tokens")
    raise UnreadError(f"the model's answer has no text{'' if written is None else ': it is empty'}")


def unmarked(text: str) -> str:
    """Remove fences, special tokens, boxes, emphasis and the marks of a formula."""
    text = _SPECIAL.sub(" ", _FENCE.sub(" ", text))
    text = _LATEX_TEXT.sub(r"\1", _LATEX_DEGREE.sub("°", text))
    return _MARKUP.sub("", _BOX.sub(r"\1", text)).strip()


def _require_ended_by_itself(choice: Json, fields: Json) -> None:
    reason = choice.get("finish_reason")
    if refusal := fields.get("refusal"):
        raise EndpointError(f"the model refuses: {printable(str(refusal))}")
    if error := choice.get("error"):
        raise EndpointError(f"the endpoint reports: {printable(str(error))}")
    if reason is not None and str(reason).lower() not in (*_WHOLE, *_CUT):
        raise EndpointError(f"the endpoint ended the answer by itself (`{printable(str(reason))}`)")


def _written(content: object) -> str | None:
    """Return the text of a message's content, a string or a list of parts; None without text."""
    if isinstance(content, str | int | float) and not isinstance(content, bool):
        return str(content)
    if not isinstance(content, list):
        return None
    parts = [part for part in content if isinstance(part, dict)]
    if not parts:
        return None
    texts = [part.get("text") for part in parts if part.get("type") not in _THOUGHT_PARTS]
    return "".join(text for text in texts if isinstance(text, str))

"""Extracts what a chat model answers from its message. Pure.

Models wrap an answer in ways of their own. Some think first, between tags or in a field of the
message; some mark an answer by special tokens, a box, a code fence or emphasis; some endpoints give
the text in parts. What is left is the answer itself, which sentence.py and chat_protocol.py read.
"""

from __future__ import annotations

import re

from hapticvlm.vlm.endpoint import EndpointError, Json

# Marks that end a thought; what precedes the last one is not the answer, even without its begin.
_THOUGHT_ENDS = re.compile(r"</(?:think|thinking|thought|reasoning)>|\[/THINK\]", re.IGNORECASE)
_THOUGHT_BEGINS = re.compile(r"<(?:think|thinking|thought|reasoning)>|\[THINK\]", re.IGNORECASE)
_THOUGHT_FIELDS = ("reasoning_content", "reasoning", "thinking")
_THOUGHT_PARTS = ("thinking", "reasoning", "redacted_thinking")
_FENCE = re.compile(r"```[a-z]*")
_SPECIAL = re.compile(r"<\|[^<>|]{1,40}\|>|</?[a-z_]{1,20}>", re.IGNORECASE)
_BOX = re.compile(r"\\boxed\s*\{([^{}]*)\}")
_LATEX_TEXT = re.compile(r"\\(?:text|mathrm)\s*\{([^{}]*)\}")
_LATEX_DEGREE = re.compile(r"\^?\s*\{?\s*\\(?:circ|degree)\b\s*\}?")
_MARKUP = re.compile(r"[$`*]|\\[,;!()\[\] ]")


class ThoughtOnlyError(EndpointError):
    """The model thought and gave no answer: its tokens ended, or it wrote nothing after it."""


def answer_text(choice: Json) -> str:
    """Return the text of a choice's answer, without thoughts and marks of its writer.

    Raises EndpointError if the message has no text, ThoughtOnlyError if it has only a thought.
    """
    message = choice.get("message")
    fields = message if isinstance(message, dict) else {}
    written = _written(fields.get("content"))
    answer = _THOUGHT_ENDS.split(written)[-1] if written is not None else ""
    answer = _THOUGHT_BEGINS.split(answer)[0]
    if answer.strip():
        return _unmarked(answer)
    has_thought = any(fields.get(name) for name in _THOUGHT_FIELDS) or bool(written)
    if has_thought or (fields and choice.get("finish_reason") == "length"):
        raise ThoughtOnlyError("the model thinks first and gave no answer within its tokens")
    if written is None:
        raise EndpointError("the endpoint's answer has no text")
    return ""


def _written(content: object) -> str | None:
    """Return the text of a message's content, a string or a list of parts; None without text."""
    if isinstance(content, str):
        return content
    if not isinstance(content, list):
        return None
    parts = [part for part in content if isinstance(part, dict)]
    if not parts:
        return None
    texts = [part.get("text") for part in parts if part.get("type") not in _THOUGHT_PARTS]
    return "".join(text for text in texts if isinstance(text, str))


def _unmarked(text: str) -> str:
    """Remove fences, special tokens, boxes, emphasis and the marks of a formula."""
    text = _SPECIAL.sub(" ", _FENCE.sub(" ", text))
    text = _LATEX_TEXT.sub(r"\1", _LATEX_DEGREE.sub("°", text))
    return _MARKUP.sub("", _BOX.sub(r"\1", text)).strip()

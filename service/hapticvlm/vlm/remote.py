"""Asks a vision-language model behind an OpenAI-compatible HTTP endpoint.

Pictures leave this machine only here, and only because the settings name a URL. There is one
question at a time and no queue: another one, or one during the pause after a failure, is refused at
once. Knows no clients and no frames.
"""

from __future__ import annotations

import random
import threading
import time
from collections.abc import Callable, Sequence
from typing import TypeVar

from hapticvlm.backoff import Breaker
from hapticvlm.evidence.ladder import Evidence
from hapticvlm.evidence.reading import Reading
from hapticvlm.vlm import chat_protocol
from hapticvlm.vlm.answer_text import ThoughtError, UnreadError
from hapticvlm.vlm.contract import (
    DEFAULT_MODEL,
    Picture,
    QuestionText,
    VlmError,
    VlmSettings,
    about_ambient,
    about_material,
)
from hapticvlm.vlm.endpoint import CHAT, MODELS, EndpointError, Json, endpoint_at

Answer = TypeVar("Answer")


class RestingError(VlmError):
    """The endpoint failed recently and is not asked again for `seconds`."""

    def __init__(self, text: str, seconds: float) -> None:
        super().__init__(text)
        self.seconds = seconds


class RemoteVlm:
    """An endpoint. Threads may share it; a question during another one is refused."""

    def __init__(self, settings: VlmSettings, now: Callable[[], float] = time.monotonic) -> None:
        """Check URL and token; sends nothing. Raises VlmError."""
        if settings.url is None:
            raise VlmError("the URL of the endpoint is missing; give --vlm-url")
        self._settings = settings
        self._now = now
        self._endpoint = endpoint_at(settings.url, settings.token, settings.header)
        self._model = None if settings.model == DEFAULT_MODEL else settings.model
        self._refused: frozenset[str] = frozenset()
        self._thinks = False
        # One for each question: a server that refuses crops of objects may still read pictures.
        self._breakers: dict[tuple[str, ...], Breaker] = {}
        self._asking = threading.Lock()

    @property
    def name(self) -> str:
        """The model and the endpoint's host."""
        return f"{self._model or self._settings.model} at {self._endpoint.address.name}"

    def ambient(self, picture: Picture) -> Reading:
        """Read the ambient temperature from a picture (H, W, 3) uint8 RGB. Raises VlmError."""
        about = about_ambient()

        def ask() -> Reading:
            begun = time.monotonic()
            stated = [
                self._answer(about, wording, (picture,), chat_protocol.stated_temperature, begun)
                for wording in range(len(about.questions))
            ]
            return chat_protocol.ambient(stated, time.monotonic() - begun)

        return self._guarded(about.questions, ask)

    def material(self, context: Picture, crop: Picture, names: Sequence[str]) -> Evidence:
        """Ask for the outlined object's material; evidence over `names`. Raises VlmError."""
        about = about_material(names)

        def read(choice: Json) -> Evidence:
            return chat_protocol.material(choice, names)

        def ask() -> Evidence:
            return self._answer(about, 0, (context, crop), read, time.monotonic())

        return self._guarded(about.questions, ask)

    def _guarded(self, question: tuple[str, ...], ask: Callable[[], Answer]) -> Answer:
        """Ask unless another question runs or the circuit is open; counts unusable answers."""
        if not self._asking.acquire(blocking=False):
            raise VlmError(f"{self.name} is busy with another question")
        breaker = self._breakers.get(question, Breaker())
        try:
            rest = breaker.rest_s(self._now())
            if rest > 0:
                pause = f"{self.name} is not asked again for {rest:.1f} s"
                raise RestingError(f"{pause} after: {breaker.reason}", rest)
            answer = ask()
            self._breakers[question] = breaker.succeeded()
            return answer
        except RestingError:
            raise
        except VlmError as error:
            wait = error.wait_s if isinstance(error, EndpointError) else None
            self._breakers[question] = breaker.failed(
                self._now(), str(error), dice=random.random(), requested_s=wait
            )
            raise
        finally:
            self._asking.release()

    def _answer(
        self,
        about: QuestionText,
        wording: int,
        pictures: Sequence[Picture],
        read: Callable[[Json], Answer],
        begun: float,
    ) -> Answer:
        """Ask and read; a thought is given room from then on, other answers are asked for again."""
        deadline = begun + self._settings.timeout_s
        budget = self._settings.image_tokens
        body = chat_protocol.question(about, wording, pictures, budget)
        body["model"] = self._model_name(deadline)
        brief = chat_protocol.again(body, about.briefly)
        while True:
            choice = self._posted(chat_protocol.thinking(body) if self._thinks else body, deadline)
            try:
                return read(choice)
            except UnreadError as error:
                if isinstance(error, ThoughtError) and not self._thinks:
                    self._thinks = True  # as are refused parameters, this is remembered
                elif body is not brief:
                    body = brief
                elif self._thinks:
                    raise UnreadError(f"{error}; the model thinks, perhaps in its answer") from None
                else:
                    raise

    def _posted(self, body: Json, deadline: float) -> Json:
        """Ask; retry without each parameter that the endpoint refuses.

        What was left out is remembered only after a request without it succeeded, so that a
        question that is wrong for another reason does not cost all later ones a parameter.
        """
        refused = self._refused
        while True:
            reduced = chat_protocol.without(body, refused)
            try:
                choice = chat_protocol.first_choice(self._endpoint.post(CHAT, reduced, deadline))
            except EndpointError as error:
                dropped = chat_protocol.refused_parameters(reduced, error)
                if not dropped or time.monotonic() > deadline:
                    raise
                refused |= dropped
            else:
                self._refused = refused
                return choice

    def _model_name(self, deadline: float) -> str:
        """Return the model's name: the configured one, else the default, else the only one."""
        if self._model is None:
            self._model = self._only_model(deadline)
        return self._model

    def _only_model(self, deadline: float) -> str:
        try:
            listed = chat_protocol.model_names(self._endpoint.get(MODELS, deadline))
        except EndpointError as error:
            if error.status is None:
                raise
            listed = []
        if DEFAULT_MODEL in listed or not listed:
            return DEFAULT_MODEL
        if len(listed) > 1:
            raise VlmError(f"the endpoint has several models; name one: {', '.join(listed)[:200]}")
        return listed[0]

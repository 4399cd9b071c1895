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

from hapticvlm.backoff import Breaker, State
from hapticvlm.evidence.ladder import Evidence
from hapticvlm.evidence.reading import Reading
from hapticvlm.vlm import chat_protocol
from hapticvlm.vlm.answer_text import ThoughtOnlyError, answer_text
from hapticvlm.vlm.contract import (
    DEFAULT_MODEL,
    Picture,
    VlmError,
    VlmSettings,
    about_ambient,
    about_material,
)
from hapticvlm.vlm.endpoint import (
    CHAT,
    MODELS,
    Endpoint,
    EndpointError,
    Json,
    check_header,
    check_token,
    read_address,
)

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
        address = read_address(settings.url)
        self._settings = settings
        self._now = now
        self._endpoint = Endpoint(
            address, check_token(settings.token, address), check_header(settings.header)
        )
        self._model = None if settings.model == DEFAULT_MODEL else settings.model
        self._refused: frozenset[str] = frozenset()
        self._thinks = False
        self._breaker, self._asking = Breaker(), threading.Lock()

    @property
    def name(self) -> str:
        """The model and the endpoint's host."""
        return f"{self._model or self._settings.model} at {self._endpoint.address.name}"

    @property
    def state(self) -> State:
        """Whether the circuit is closed, open or half-open."""
        return self._breaker.state(self._now())

    def ambient(self, picture: Picture) -> Reading:
        """Read the ambient temperature from a picture (H, W, 3) uint8 RGB. Raises VlmError."""
        question = about_ambient()
        tokens = self._settings.image_tokens

        def ask() -> Reading:
            begun = time.monotonic()
            choices = [
                self._choice(chat_protocol.question(question, wording, (picture,), tokens), begun)
                for wording in range(len(question.questions))
            ]
            seconds = time.monotonic() - begun
            reading = chat_protocol.ambient_by_logprobs(choices, seconds)
            return chat_protocol.ambient_by_text(choices, seconds) if reading is None else reading

        return self._guarded(ask)

    def material(self, context: Picture, crop: Picture, names: Sequence[str]) -> Evidence:
        """Ask for the outlined object's material; evidence over `names`. Raises VlmError."""
        body = chat_protocol.question(
            about_material(names), 0, (context, crop), self._settings.image_tokens
        )

        def ask() -> Evidence:
            choice = self._choice(body, time.monotonic())
            evidence = chat_protocol.material_by_logprobs(choice, names)
            return chat_protocol.material_by_text(choice, names) if evidence is None else evidence

        return self._guarded(ask)

    def close(self) -> None:
        """Do nothing, since no connection is kept between questions."""

    def _guarded(self, ask: Callable[[], Answer]) -> Answer:
        """Ask unless another question runs or the circuit is open; counts unusable answers."""
        if not self._asking.acquire(blocking=False):
            raise VlmError(f"{self.name} is busy with another question")
        try:
            rest = self._breaker.rest_s(self._now())
            if rest > 0:
                pause = f"{self.name} is not asked again for {rest:.1f} s"
                raise RestingError(f"{pause} after: {self._breaker.reason}", rest)
            return self._counted(ask)
        finally:
            self._asking.release()

    def _counted(self, ask: Callable[[], Answer]) -> Answer:
        try:
            answer = ask()
        except VlmError as error:
            wait = error.wait_s if isinstance(error, EndpointError) else None
            self._breaker = self._breaker.failed(
                self._now(), str(error), dice=random.random(), requested_s=wait
            )
            raise
        self._breaker = self._breaker.succeeded()
        return answer

    def _choice(self, body: Json, begun: float) -> Json:
        """Ask; a model that thinks first is asked once more with room for its thought."""
        deadline = begun + self._settings.timeout_s
        body = {"model": self._model_name(deadline), **body}
        if not self._thinks:
            choice = self._posted(body, deadline)
            try:
                answer_text(choice)
            except ThoughtOnlyError:
                self._thinks = True  # as are refused parameters, this is remembered
            else:
                return choice
        return self._posted(chat_protocol.thinking(body), deadline)

    def _posted(self, body: Json, deadline: float) -> Json:
        """Ask; retry without each parameter that the endpoint refuses.

        Refused parameters are remembered only after a request without them succeeded, so that a
        question that is wrong for another reason does not cost all later ones their
        log-probabilities.
        """
        refused = self._refused
        while True:
            reduced = chat_protocol.without(body, refused)
            try:
                choice = chat_protocol.first_choice(self._endpoint.post(CHAT, reduced, deadline))
            except EndpointError as error:
                parameter = chat_protocol.refused_parameter(reduced, error.status, str(error))
                if parameter is None:
                    raise
                refused |= {parameter}
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

"""A vision-language model behind an OpenAI-compatible HTTP endpoint: many headsets, one GPU.

Pictures leave this machine here and nowhere else, and only because the settings name a url. One
question is under way at a time, none waits: whoever comes meanwhile, or while a failing endpoint
rests, is turned away at once. Knows no clients and no frames.
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
from hapticvlm.vlm.contract import (
    DEFAULT_MODEL,
    Picture,
    VlmError,
    VlmSettings,
    about_ambient,
    about_material,
)
from hapticvlm.vlm.endpoint import Endpoint, EndpointError, Json, check_token, read_address

CHAT = "/v1/chat/completions"
MODELS = "/v1/models"

Answer = TypeVar("Answer")


class RestingError(VlmError):
    """The endpoint failed lately and is not asked for another `seconds`."""

    def __init__(self, text: str, seconds: float) -> None:
        super().__init__(text)
        self.seconds = seconds


class RemoteVlm:
    """An endpoint. Threads may share it; who comes while it is asked is turned away."""

    is_remote = True

    def __init__(self, settings: VlmSettings, now: Callable[[], float] = time.monotonic) -> None:
        """Read url and token; nothing is sent yet. Raises VlmError."""
        if settings.url is None:
            raise VlmError("no url of an endpoint is given")
        address = read_address(settings.url)
        self._settings = settings
        self._now = now
        self._endpoint = Endpoint(address, check_token(settings.token, address))
        self._model = None if settings.model == DEFAULT_MODEL else settings.model
        self._refused: frozenset[str] = frozenset()
        self._breaker, self._asking = Breaker(), threading.Lock()

    @property
    def name(self) -> str:
        """The model and where it is."""
        return f"{self._model or self._settings.model} at {self._endpoint.address.name}"

    @property
    def state(self) -> State:
        """Whether the circuit is closed, open or half-open."""
        return self._breaker.state(self._now())

    def ambient(self, picture: Picture) -> Reading:
        """Read the ambient temperature off a picture (H, W, 3) uint8 RGB. Raises VlmError."""
        asked = about_ambient()
        tokens = self._settings.image_tokens

        def ask() -> Reading:
            begun = time.monotonic()
            choices = [
                self._choice(chat_protocol.question(asked, wording, (picture,), tokens), begun)
                for wording in range(len(asked.questions))
            ]
            seconds = time.monotonic() - begun
            reading = chat_protocol.ambient_by_logprobs(choices, seconds)
            return chat_protocol.ambient_by_text(choices, seconds) if reading is None else reading

        return self._guarded(ask)

    def material(self, context: Picture, crop: Picture, names: Sequence[str]) -> Evidence:
        """Ask what the outlined object is made of; evidence over `names`. Raises VlmError."""
        body = chat_protocol.question(
            about_material(names), 0, (context, crop), self._settings.image_tokens
        )

        def ask() -> Evidence:
            choice = self._choice(body, time.monotonic())
            evidence = chat_protocol.material_by_logprobs(choice, names)
            return chat_protocol.material_by_text(choice, names) if evidence is None else evidence

        return self._guarded(ask)

    def close(self) -> None:
        """Nothing is held between questions."""

    def _guarded(self, ask: Callable[[], Answer]) -> Answer:
        """Ask unless it is being asked or rests; an answer of no use counts as a failure."""
        if not self._asking.acquire(blocking=False):
            raise VlmError(f"{self.name} is still busy with the question before")
        try:
            rest = self._breaker.rest_s(self._now())
            if rest > 0:
                text = f"{self.name} is not asked for {rest:.1f} s after: {self._breaker.reason}"
                raise RestingError(text, rest)
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
        """Ask, and once more without each parameter that the endpoint refuses.

        What it refused is remembered as soon as an answer came without it: a question that is
        wrong for another reason must not cost the log-probabilities of all later ones.
        """
        deadline = begun + self._settings.timeout_s
        body = {"model": self._asked_model(deadline), **body}
        refused = self._refused
        while True:
            asked = chat_protocol.without(body, refused)
            try:
                choice = chat_protocol.first_choice(self._endpoint.post(CHAT, asked, deadline))
            except EndpointError as error:
                wrong = chat_protocol.refused_parameter(asked, error.status, str(error))
                if wrong is None:
                    raise
                refused |= {wrong}
            else:
                self._refused = refused
                return choice

    def _asked_model(self, deadline: float) -> str:
        """Name the model: the one given, else the default, else the only one there is."""
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
            raise VlmError(f"the endpoint has several models, name one: {', '.join(listed)[:200]}")
        return listed[0]

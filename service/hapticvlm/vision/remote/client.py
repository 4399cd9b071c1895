"""Sends crops to a shared recogniser, within a deadline, and stops while it fails.

Requests are made by a second thread, so that nothing, not even a slow name lookup, delays a
recognition for longer than its share of the deadline. After a failure every crop is recognised
locally at once, by an encoder that this machine loads for the first of them. A grey crop is sent
from time to time, and only when it is answered in time are crops sent again. So a fault costs one
crop its share of the deadline, and recovery costs nothing.
"""

from __future__ import annotations

import http
import json
import logging
import queue
import random
import threading
import time
from collections.abc import Collection, Sequence
from dataclasses import dataclass

import numpy as np

from hapticvlm.backoff import Breaker
from hapticvlm.http_client import HttpClient, HttpError, printable
from hapticvlm.vision.pictures import Crop, central_mask
from hapticvlm.vision.remote import contract
from hapticvlm.vision.remote.contract import (
    MAX_ANSWER_BYTES,
    MESSAGEPACK,
    ContractError,
    Identity,
    RemoteMatch,
)
from hapticvlm.vision.remote.settings import RemoteSettings, RemoteState

OPEN_S = 5.0  # pause of an open circuit; it may be short, since probes delay no crop
PROBE_S = 5.0  # limit for opening a connection and getting an identity
LONGEST_S = 5.0  # for crops of one request, however many: our choice
FIND_S = 2.0  # at the start, for probes that fail: our choice
POLL_S = 0.01

logger = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class _Outcome:
    identity: Identity | None = None
    matches: Sequence[RemoteMatch] = ()
    error: str | None = None


class _Job:
    """A request for `crops`, or a probe without any; read `outcome` once `done` is set."""

    def __init__(self, crops: Sequence[Crop], identity: Identity | None, until: float) -> None:
        self.crops = crops
        self.identity = identity
        self.until = until
        self.done = threading.Event()
        self.outcome = _Outcome()


class RemoteRecogniser:
    """A client of a shared recogniser, used by one thread; `known` are the service's materials."""

    def __init__(self, settings: RemoteSettings, known: Collection[str]) -> None:
        """Check URL and token; sends nothing. Raises HttpError."""
        self._address = settings.address()
        self._settings, self._known = settings, frozenset(known)
        self._breaker = Breaker(open_s=OPEN_S)
        self._jobs: queue.SimpleQueue[_Job] = queue.SimpleQueue()
        self._pending: _Job | None = None
        self._identity: Identity | None = None
        self._reason = ""
        self._answered = self._failed = self._local = 0
        threading.Thread(target=self._run, name="remote recogniser", daemon=True).start()

    @property
    def identity(self) -> Identity | None:
        """The identity of the recogniser while crops are sent to it; None otherwise."""
        return self._identity

    @property
    def state(self) -> RemoteState:
        """Whether crops are sent, and the counts, for telemetry."""
        identity = self._identity
        place = self._address.name
        counts = self._answered, self._failed, self._local
        if identity is None:
            reason = f"{place}: {self._reason}" if self._reason else ""
            return RemoteState(False, reason, "", *counts)
        named = f"{identity.encoder}, gallery {identity.gallery}, {identity.hash} at {place}"
        return RemoteState(True, "", named, *counts)

    def probe(self) -> None:
        """Start a probe unless one is running or the circuit is open; apply a finished one."""
        pending = self._pending
        if pending is not None:
            if not pending.done.is_set():
                return
            self._pending = None
            # Only a probe's outcome is applied late. A crop's was judged when its deadline passed;
            # applying its answer now would close the circuit of a recogniser that is too slow.
            if not pending.crops:
                self._judge(pending.outcome)
        if self._identity is None and self._breaker.rest_s(time.monotonic()) <= 0.0:
            self._submit((), time.monotonic() + PROBE_S)

    def find(self) -> bool:
        """Probe, for FIND_S again if that fails; return whether crops are sent from now on."""
        until = time.monotonic() + FIND_S
        while self._identity is None and (self._pending or time.monotonic() < until):
            self.probe()
            time.sleep(POLL_S)
        return self._identity is not None

    def recognise(self, crops: Sequence[Crop]) -> Sequence[RemoteMatch] | None:
        """Recognise crops of the identity's side; None: the caller recognises them locally.

        Each crop adds its share of the deadline.
        """
        if self._identity is None:
            self._local += 1
            return None
        # The other thread makes the request and this one waits. That thread has the same deadline
        # and keeps it, except during a name lookup, which cannot be cancelled. So this thread stops
        # waiting by itself. A job that finishes later is dropped by the next `probe`, and no crop
        # is sent until then.
        limit_s = min(LONGEST_S, self._settings.remote_s * len(crops))
        job = self._submit(crops, time.monotonic() + limit_s)
        if job.done.wait(limit_s):
            self._pending = None
            outcome = job.outcome
        else:  # the thread may still wait for a name lookup
            outcome = _Outcome(error=f"no answer within {1000.0 * limit_s:.0f} ms")
        self._judge(outcome)
        if not outcome.matches:
            self._local += 1
            return None
        self._answered += 1
        return outcome.matches

    def _submit(self, crops: Sequence[Crop], until: float) -> _Job:
        self._pending = job = _Job(crops, self._identity, until)
        self._jobs.put(job)
        return job

    def _judge(self, outcome: _Outcome) -> None:
        if outcome.error is None:
            self._breaker = self._breaker.succeeded()
            self._identity = outcome.identity
            return
        self._failed += 1
        self._identity = None
        self._reason = outcome.error
        now = time.monotonic()
        self._breaker = self._breaker.failed(now, outcome.error, dice=random.random())

    def _run(self) -> None:
        token = self._settings.token
        client = HttpClient(self._address, token, MESSAGEPACK, MAX_ANSWER_BYTES)
        while True:
            job = self._jobs.get()
            try:
                job.outcome = self._outcome(client, job)
            except (HttpError, ContractError) as error:
                job.outcome = _Outcome(error=str(error))
            except Exception as error:  # a bug of ours must not end the thread
                logger.exception("asking the shared recogniser failed")
                job.outcome = _Outcome(error=type(error).__name__)
            job.done.set()

    def _outcome(self, client: HttpClient, job: _Job) -> _Outcome:
        if job.crops and job.identity is not None:
            matches = self._ask(client, job.crops, job.identity, job.until)
            return _Outcome(job.identity, matches)
        path = f"{contract.IDENTITY}?gallery={self._settings.gallery}"
        identity = contract.read_identity(_answer(client, "GET", path, None, job.until))
        self._check(identity)
        side = identity.side
        grey = Crop(np.full((side, side, 3), 127, np.uint8), central_mask(side))
        # Even a machine whose GPU is overloaded returns its identity quickly. So a grey crop is
        # sent with the deadline of a real one, and a recogniser that misses it is not used.
        self._ask(client, [grey], identity, time.monotonic() + self._settings.remote_s)
        return _Outcome(identity)

    def _ask(
        self, client: HttpClient, crops: Sequence[Crop], identity: Identity, until: float
    ) -> Sequence[RemoteMatch]:
        settings = self._settings
        wait_ms = max(1.0, 1000.0 * (until - time.monotonic()))
        body = contract.write_request(crops, settings.gallery, wait_ms=wait_ms)
        data = _answer(client, "POST", contract.RECOGNISE, body, until)
        try:
            return contract.read_answer(data, identity, len(crops))[1]
        except ContractError:
            client.close()
            raise

    def _check(self, identity: Identity) -> None:
        """Refuse a recogniser other than the required one. Raises ContractError."""
        required = self._settings.hash
        if identity.gallery != self._settings.gallery:
            raise ContractError(f"it answers with gallery `{identity.gallery[:64]}`")
        if required is not None and identity.hash != required:
            raise ContractError(f"its identity is {identity.hash[:64]}, not {required} as required")
        unknown = sorted(set(identity.materials) - self._known)
        if unknown:
            problem = f"its gallery has `{unknown[0][:64]}`, which this service does not know"
            raise ContractError(f"{problem}; give serve the same --gallery")


def _answer(client: HttpClient, verb: str, path: str, body: bytes | None, deadline: float) -> bytes:
    """Return the body of a response; `deadline` is a time.monotonic, s. Raises HttpError."""
    response = client.request(verb, path, body, deadline)
    if response.status == http.HTTPStatus.OK:
        return response.body
    is_refused = response.status in (http.HTTPStatus.UNAUTHORIZED, http.HTTPStatus.FORBIDDEN)
    cure = "; its token is read from HAPTICVLM_RECOGNISER_TOKEN" if is_refused else ""
    raise HttpError(client.redacted(f"HTTP {response.status}: {_reason(response.body)}{cure}"))


def _reason(data: bytes) -> str:
    try:
        text = json.loads(data)["error"]
    except (ValueError, KeyError, TypeError, RecursionError):
        text = data[:400].decode("utf-8", "replace")
    return printable(str(text)) or "no message"

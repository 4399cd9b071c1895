"""Sends crops to a shared recogniser, within a deadline, and stops while it fails.

Requests are made by a second thread, so that nothing, not even a slow name lookup, delays a
recognition for longer than its share of the deadline. After a failure every crop is recognised
locally at once. A grey crop is sent from time to time, and only when it is answered in time are
crops sent again. So a fault costs one crop its share of the deadline, and recovery costs nothing.
"""

from __future__ import annotations

import logging
import queue
import random
import threading
import time
from collections.abc import Collection
from dataclasses import dataclass

import numpy as np

from hapticvlm.backoff import Breaker
from hapticvlm.http_client import HttpError
from hapticvlm.vision.pictures import Crop, central_mask
from hapticvlm.vision.remote import contract
from hapticvlm.vision.remote.contract import ContractError, Identity, RemoteMatch
from hapticvlm.vision.remote.exchange import Exchange
from hapticvlm.vision.remote.settings import RemoteSettings, RemoteState

OPEN_S = 5.0  # pause of an open circuit; it may be short, since probes delay no crop
PROBE_S = 5.0  # limit for opening a connection and getting an identity

logger = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class _Outcome:
    identity: Identity | None = None
    match: RemoteMatch | None = None
    error: str | None = None


class _Job:
    """A request for a `crop`, or a probe without one; read `outcome` once `done` is set."""

    def __init__(self, crop: Crop | None, identity: Identity | None, until: float) -> None:
        self.crop = crop
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
            if pending.crop is None:
                self._judge(pending.outcome)
        if self._identity is None and self._breaker.rest_s(time.monotonic()) <= 0.0:
            self._submit(None, time.monotonic() + PROBE_S)

    def recognise(self, crop: Crop) -> RemoteMatch | None:
        """Recognise a crop of the identity's side; None: the caller recognises it locally."""
        if self._identity is None:
            self._local += 1
            return None
        # The other thread makes the request and this one waits. That thread has the same deadline
        # and keeps it, except during a name lookup, which cannot be cancelled. So this thread stops
        # waiting by itself. A job that finishes later is dropped by the next `probe`, and no crop
        # is sent until then.
        job = self._submit(crop, time.monotonic() + self._settings.remote_s)
        if job.done.wait(self._settings.remote_s):
            self._pending = None
            outcome = job.outcome
        else:  # the thread may still wait for a name lookup
            outcome = _Outcome(error=f"no answer within {1000.0 * self._settings.remote_s:.0f} ms")
        self._judge(outcome)
        # A recogniser that believes nothing of a crop may be well: its gallery has nothing like it.
        # Taking that for the answer would leave the object unknown where this machine may know it.
        if outcome.match is None or outcome.match.evidence.confidence <= 0.0:
            self._local += 1
            return None
        self._answered += 1
        return outcome.match

    def _submit(self, crop: Crop | None, until: float) -> _Job:
        self._pending = job = _Job(crop, self._identity, until)
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
        exchange = Exchange(self._address, self._settings.token)
        while True:
            job = self._jobs.get()
            try:
                job.outcome = self._outcome(exchange, job)
            except (HttpError, ContractError) as error:
                job.outcome = _Outcome(error=str(error))
            except Exception as error:  # a bug of ours must not end the thread
                logger.exception("asking the shared recogniser failed")
                job.outcome = _Outcome(error=type(error).__name__)
            job.done.set()

    def _outcome(self, exchange: Exchange, job: _Job) -> _Outcome:
        if job.crop is not None and job.identity is not None:
            match = self._ask(exchange, job.crop, job.identity, job.until)
            return _Outcome(job.identity, match)
        path = f"{contract.IDENTITY}?gallery={self._settings.gallery}"
        identity = contract.read_identity(exchange.ask("GET", path, None, job.until))
        self._check(identity)
        side = identity.side
        grey = Crop(np.full((side, side, 3), 127, np.uint8), central_mask(side))
        # Even a machine whose GPU is overloaded returns its identity quickly. So a grey crop is
        # sent with the deadline of a real one, and a recogniser that misses it is not used.
        self._ask(exchange, grey, identity, time.monotonic() + self._settings.remote_s)
        return _Outcome(identity)

    def _ask(self, exchange: Exchange, crop: Crop, identity: Identity, until: float) -> RemoteMatch:
        settings = self._settings
        wait_ms = max(1.0, 1000.0 * (until - time.monotonic()))
        body = contract.write_request([crop], settings.gallery, wait_ms=wait_ms)
        data = exchange.ask("POST", contract.RECOGNISE, body, until)
        try:
            _, (match,) = contract.read_answer(data, identity, 1)
        except ContractError:
            exchange.close()
            raise
        return match

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

"""A shared recogniser as the local one sees it: asked within a time, not asked while it fails.

A thread asks, so that nothing, not even a name that cannot be looked up, holds up a recognition
for longer than its share of the deadline. After a failure every crop is recognised locally at once;
a grey crop is sent now and then, and only when that is answered in time are crops sent again. So a
fault costs one crop its share of the deadline, and recovery none.
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

OPEN_S = 5.0  # rest of an open circuit: a probe delays no crop
PROBE_S = 5.0  # to open a connection and get an identity

logger = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class _Outcome:
    identity: Identity | None = None
    found: RemoteMatch | None = None
    error: str | None = None


class _Job:
    """One request for a `crop`, or a probe without; `outcome` is there once `done` is set."""

    def __init__(self, crop: Crop | None, identity: Identity | None, until: float) -> None:
        self.crop = crop
        self.identity = identity
        self.until = until
        self.done = threading.Event()
        self.outcome = _Outcome()


class RemoteRecogniser:
    """Asks a shared recogniser. For one thread; `known` are the materials the service has."""

    def __init__(self, settings: RemoteSettings, known: Collection[str]) -> None:
        """Check url and token; nothing is sent before the first crop. Raises HttpError."""
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
        """The identity that answers while crops are sent to it."""
        return self._identity

    @property
    def state(self) -> RemoteState:
        """Return its state."""
        identity = self._identity
        place = self._address.name
        counts = self._answered, self._failed, self._local
        if identity is None:
            reason = f"{place}: {self._reason}" if self._reason else ""
            return RemoteState(False, reason, "", *counts)
        named = f"{identity.encoder}, gallery {identity.gallery}, {identity.hash} at {place}"
        return RemoteState(True, "", named, *counts)

    def probe(self) -> None:
        """Try it unless it rests or is being tried; use what an earlier try found."""
        pending = self._pending
        if pending is not None:
            if not pending.done.is_set():
                return
            self._pending = None
            # Only a probe's outcome is used late. A crop's has been judged when its time was over;
            # taking its answer now would heal a circuit that is too slow to be of use.
            if pending.crop is None:
                self._judge(pending.outcome)
        if self._identity is None and self._breaker.rest_s(time.monotonic()) <= 0.0:
            self._submit(None, time.monotonic() + PROBE_S)

    def recognise(self, crop: Crop) -> RemoteMatch | None:
        """Recognise a crop of the identity's side; None: do it locally."""
        if self._identity is None:
            self._local += 1
            return None
        # Asked by the other thread, waited for in this one. The thread has the same deadline and
        # keeps it, but for one thing that cannot be cancelled: looking up a host's name. So this
        # side waits no longer than the share of the other machine in any case. What comes after
        # that is nobody's: the next `probe` finds the job done and drops it, and no crop is sent
        # while it is not.
        job = self._submit(crop, time.monotonic() + self._settings.remote_s)
        if job.done.wait(self._settings.remote_s):
            self._pending = None
            outcome = job.outcome
        else:  # the thread may still be looking up a name
            outcome = _Outcome(error=f"no answer within {1000.0 * self._settings.remote_s:.0f} ms")
        self._judge(outcome)
        if outcome.found is None:
            self._local += 1
        else:
            self._answered += 1
        return outcome.found

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
            found = self._ask(exchange, job.crop, job.identity, job.until)
            return _Outcome(job.identity, found)
        path = f"{contract.IDENTITY}?gallery={self._settings.gallery}"
        identity = contract.read_identity(exchange.ask("GET", path, None, job.until))
        self._check(identity)
        side = identity.side
        grey = Crop(np.full((side, side, 3), 127, np.uint8), central_mask(side))
        # An identity is quick to give, also for a machine whose graphics card is busy. So a grey
        # crop is asked within the time that a real one would have: what cannot keep it is not used.
        self._ask(exchange, grey, identity, time.monotonic() + self._settings.remote_s)
        return _Outcome(identity)

    def _ask(self, exchange: Exchange, crop: Crop, identity: Identity, until: float) -> RemoteMatch:
        settings = self._settings
        wait_ms = max(1.0, 1000.0 * (until - time.monotonic()))
        body = contract.write_request(
            [crop], settings.gallery, format=settings.format, wait_ms=wait_ms
        )
        data = exchange.ask("POST", contract.RECOGNISE, body, until)
        try:
            _, (found,) = contract.read_answer(data, identity, 1)
        except ContractError:
            exchange.close()
            raise
        return found

    def _check(self, identity: Identity) -> None:
        """Refuse a recogniser that is not the one wanted. Raises ContractError."""
        wanted = self._settings.hash
        if identity.gallery != self._settings.gallery:
            raise ContractError(f"it answers with gallery `{identity.gallery[:64]}`")
        if wanted is not None and identity.hash != wanted:
            raise ContractError(f"its identity is {identity.hash[:64]}, not {wanted} as demanded")
        unknown = sorted(set(identity.materials) - self._known)
        if unknown:
            text = f"its gallery has `{unknown[0][:64]}`, which this service does not know"
            raise ContractError(f"{text}: give serve the same --gallery")

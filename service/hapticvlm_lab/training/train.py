"""Train the encoder: `python -m hapticvlm_lab.training.train --data D --run R --shards FOLDER...`.

Distils the teacher's feature of every picture (labelled or not), tells the classes apart, and in
its last part pulls pictures of one class together (supervised contrast). One process, plain torch,
on CPU or GPU; picks up from the newest checkpoint in R. Weights are averaged over time.
"""

from __future__ import annotations

import argparse
import copy
import json
import math
import shutil
import sys
import time
from dataclasses import asdict, dataclass, field
from pathlib import Path

import numpy as np
import torch
from torch import Tensor
from torch.nn import functional

from hapticvlm_lab.training import augment, table
from hapticvlm_lab.training.losses import Heads, Weights
from hapticvlm_lab.training.network import Network, Shape, prepare

CHECKPOINT = "checkpoint.pt"
BASIS = "basis.npz"
SAVE_S = 120.0
SAY_EVERY = 50
AVERAGE = 0.998


@dataclass(frozen=True, slots=True)
class Plan:
    """Everything that makes a run what it is."""

    shape: Shape = field(default_factory=Shape)
    weights: Weights = field(default_factory=Weights)
    steps: int = 4000
    batch: int = 96
    side: int = 96
    late_side: int = 128
    late: float = 0.25  # share of the steps at `late_side`
    contrast_from: float = 0.5
    contrast: float = 0.25
    rate: float = 2e-3
    decay: float = 0.05
    warm_up: int = 300
    unlabelled: float = 0.35
    seed: int = 1


class Run:
    """Network, heads, optimiser and the running average: all that a checkpoint holds."""

    def __init__(self, plan: Plan, device: torch.device) -> None:
        torch.manual_seed(plan.seed)
        self.plan, self.device, self.step = plan, device, 0
        self.network = Network(plan.shape).to(device)
        self.network.to(memory_format=torch.channels_last)  # type: ignore[call-overload]
        features = 2 * plan.shape.widths[-1]
        heads = Heads(features, plan.shape.dimension, table.TARGET, len(table.CLASSES))
        self.heads = heads.to(device)
        self.average = copy.deepcopy(self.network)
        parameters = [*self.network.parameters(), *self.heads.parameters()]
        matrices = [p for p in parameters if p.dim() > 1]
        vectors = [p for p in parameters if p.dim() <= 1]
        groups = [
            {"params": matrices, "weight_decay": plan.decay},
            {"params": vectors, "weight_decay": 0.0},
        ]
        self.optimiser = torch.optim.AdamW(groups, lr=plan.rate, betas=(0.9, 0.98))

    def learn(self, crops: Tensor, targets: Tensor, labels: Tensor) -> dict[str, float]:
        """Take one step on a batch; return the losses."""
        for group in self.optimiser.param_groups:
            group["lr"] = self._rate()
        self.network.train()
        planes = prepare(crops).to(memory_format=torch.channels_last)
        features = self.network.features(planes)
        embeddings = functional.normalize(self.network.project(features), dim=1)
        losses = self.heads.losses(features, embeddings, targets, labels)
        weights = asdict(self.plan.weights)
        if self.step >= self.plan.contrast_from * self.plan.steps:
            weights["contrast"] = self.plan.contrast
        total = torch.stack([losses[name] * weight for name, weight in weights.items()]).sum()
        self.optimiser.zero_grad()
        total.backward()  # type: ignore[no-untyped-call]
        torch.nn.utils.clip_grad_norm_(self.network.parameters(), 2.0)
        self.optimiser.step()
        self._follow()
        self.step += 1
        return {name: float(loss.detach()) for name, loss in losses.items()}

    def save(self, path: Path) -> None:
        """Write all of it; whole or not at all."""
        held = {
            "step": self.step,
            "network": self.network.state_dict(),
            "heads": self.heads.state_dict(),
            "average": self.average.state_dict(),
            "optimiser": self.optimiser.state_dict(),
        }
        part = path.with_suffix(".part")
        torch.save(held, part)
        part.replace(path)

    def load(self, path: Path) -> None:
        """Go on from a checkpoint."""
        held = torch.load(path, map_location=self.device, weights_only=True)
        self.step = held["step"]
        self.network.load_state_dict(held["network"])
        self.heads.load_state_dict(held["heads"])
        self.average.load_state_dict(held["average"])
        self.optimiser.load_state_dict(held["optimiser"])

    def begin_with(self, path: Path) -> None:
        """Take over network and heads of another run, at their average; begin its own plan."""
        held = torch.load(path, map_location=self.device, weights_only=True)
        for network in (self.network, self.average):
            network.load_state_dict(held["average"])
        self.heads.load_state_dict(held["heads"])

    def _rate(self) -> float:
        plan = self.plan
        done = min(1.0, self.step / plan.steps)
        return (
            plan.rate
            * min(1.0, (self.step + 1) / plan.warm_up)
            * (0.02 + 0.98 * 0.5 * (1 + math.cos(math.pi * done)))
        )

    @torch.no_grad()
    def _follow(self) -> None:
        share = min(AVERAGE, self.step / (self.step + 20))
        for slow, fast in zip(
            self.average.state_dict().values(), self.network.state_dict().values(), strict=True
        ):
            if slow.dtype.is_floating_point:
                slow.lerp_(fast, 1 - share)
            else:
                slow.copy_(fast)


def main() -> int:
    """Read the command line and train."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--run", type=Path, required=True, help="folder for checkpoint and log")
    parser.add_argument("--shards", type=Path, nargs="+", required=True, help="folders of shards")
    parser.add_argument("--start", type=Path, help="run whose network to begin with")
    parser.add_argument("--device", default="cpu")
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--plan", type=json.loads, default={}, help="fields of Plan, as JSON")
    chosen = parser.parse_args()
    torch.set_num_threads(chosen.threads)
    plan = _plan(chosen.plan)
    chosen.run.mkdir(parents=True, exist_ok=True)
    (chosen.run / "plan.json").write_text(json.dumps(asdict(plan), indent=1) + "\n")
    run = Run(plan, torch.device(chosen.device))
    if (chosen.run / CHECKPOINT).exists():
        run.load(chosen.run / CHECKPOINT)
    elif chosen.start is not None:
        run.begin_with(chosen.start / CHECKPOINT)
        shutil.copy(chosen.start / BASIS, chosen.run / BASIS)
    train(run, chosen.run, chosen.shards)
    return 0


def train(run: Run, folder: Path, shards: list[Path]) -> None:
    """Train to the end of the plan, saving now and then."""
    plan, known = run.plan, table.load(shards, folder / BASIS)
    _say(f"{len(known.labels)} pictures, {len(known.names)} cells, from step {run.step}")
    draws = table.Draws(known, plan.unlabelled, plan.seed + run.step)
    dice = torch.Generator().manual_seed(plan.seed + run.step)
    started = saved = time.monotonic()
    first, sums = run.step, dict[str, float]()
    while run.step < plan.steps:
        rows = draws.batch(plan.batch)
        side = plan.late_side if run.step >= (1 - plan.late) * plan.steps else plan.side
        crops = augment.vary(torch.from_numpy(known.crops[rows]), side, dice)
        targets, labels = (
            torch.from_numpy(known.targets[rows]),
            torch.from_numpy(known.labels[rows]),
        )
        losses = run.learn(crops.to(run.device), targets.to(run.device), labels.to(run.device))
        sums = {name: sums.get(name, 0.0) + value for name, value in losses.items()}
        if run.step % SAY_EVERY == 0:
            speed = (run.step - first) * plan.batch / (time.monotonic() - started)
            shown = " ".join(f"{name} {value / SAY_EVERY:.3f}" for name, value in sums.items())
            _say(f"step {run.step}/{plan.steps} {speed:.0f}/s {shown}")
            sums = {}
        if time.monotonic() - saved > SAVE_S or run.step == plan.steps:
            run.save(folder / CHECKPOINT)
            saved = time.monotonic()


def _plan(given: dict[str, object]) -> Plan:
    shape = Shape(**given.pop("shape", {}))  # type: ignore[arg-type]
    weights = Weights(**given.pop("weights", {}))  # type: ignore[arg-type]
    return Plan(shape=shape, weights=weights, **given)  # type: ignore[arg-type]


def _say(text: str) -> None:
    sys.stderr.write(text + "\n")
    sys.stderr.flush()


if __name__ == "__main__":
    np.random.seed(0)  # noqa: NPY002
    sys.exit(main())

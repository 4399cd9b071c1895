"""Distil the teachers into the student: `python -m hapticvlm_lab.training.distil --pool P --run R`.

The rate stays constant and training goes on for ever, checkpoint by checkpoint: there is no end to
plan. What ships is a branch that cools down: `--begin R --cool STEPS` brings the rate to zero.
Loss: 1.5 (1 - cosine) to each teacher, 0.5 cross entropy to what their class names say of
materials, 0.6 to the classes of labelled pictures.

"""

from __future__ import annotations

import argparse
import copy
import json
import shutil
import sys
import time
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import torch
from torch import Tensor, nn
from torch.nn import functional

from hapticvlm_lab.training.answers import BASIS, CLASSES, DIRECTIONS, Pool, Targets
from hapticvlm_lab.training.network import Network, Shape, prepare
from hapticvlm_lab.training.teacher import FILES
from hapticvlm_lab.training.variations import mix, resize, vary

CHECKPOINT = "checkpoint.pt"
AVERAGE = 0.998
SMOOTHING = 0.1
LEFT_OUT_AT_MOST = 1500
REPORT_EVERY, LEFT_OUT_EVERY, REFRESH_EVERY = 200, 1000, 200
WEIGHTS = {**dict.fromkeys(FILES, 1.5), "names": 0.5, "classes": 0.6}


@dataclass(frozen=True, slots=True)
class Plan:
    """Everything that makes a run what it is."""

    shape: Shape = field(default_factory=Shape)
    batch: int = 96
    side: int = 96  # px
    rate: float = 2.5e-3
    decay: float = 0.05
    warm_up: int = 300
    cool: int = 0  # steps until the rate is zero; 0: it stays
    seed: int = 7


@dataclass(slots=True)
class Progress:
    """How far a run is: steps, samples, CPU seconds; `first` is the step the cooling began at."""

    step: int = 0
    samples: int = 0
    cpu_s: float = 0.0
    first: int = 0


class Run:
    """Network, heads, optimiser and the running average: all that a checkpoint holds."""

    def __init__(self, plan: Plan, names: int) -> None:
        torch.manual_seed(plan.seed)
        self.plan, self.progress = plan, Progress()
        self._in_bfloat16 = is_bfloat16_fast()
        layout = {"memory_format": torch.channels_last}
        self.network = Network(plan.shape).to(**layout)  # type: ignore[call-overload]
        features = 2 * plan.shape.widths[-1]
        sizes = {**dict.fromkeys(FILES, DIRECTIONS), "names": names, "classes": len(CLASSES)}
        self.heads = nn.ModuleDict({name: nn.Linear(features, n) for name, n in sizes.items()})
        self.model = nn.ModuleDict({"network": self.network, "heads": self.heads})
        self.average = copy.deepcopy(self.model)
        every = list(self.model.parameters())
        groups = [
            {"params": [p for p in every if p.dim() > 1], "weight_decay": plan.decay},
            {"params": [p for p in every if p.dim() <= 1], "weight_decay": 0.0},
        ]
        self.optimiser = torch.optim.AdamW(groups, lr=plan.rate, betas=(0.9, 0.98))

    @property
    def is_done(self) -> bool:
        """Whether the rate has reached zero."""
        return self.plan.cool > 0 and self.progress.step - self.progress.first >= self.plan.cool

    def learn(self, planes: Tensor, wanted: dict[str, Tensor], known: Tensor) -> dict[str, float]:
        """Take one step on prepared planes; `known` (N,) weighs the classes. Return the losses."""
        started = time.process_time()
        for group in self.optimiser.param_groups:
            group["lr"] = self._rate()
        self.model.train()
        with torch.autocast("cpu", torch.bfloat16, enabled=self._in_bfloat16):
            features = self.network.features(planes.to(memory_format=torch.channels_last))
        losses = self.losses(features.float(), wanted, known)
        total = torch.stack([losses[name] * weight for name, weight in WEIGHTS.items()]).sum()
        self.optimiser.zero_grad()
        torch.autograd.backward(total)
        torch.nn.utils.clip_grad_norm_(self.model.parameters(), 2.0)
        self.optimiser.step()
        self._average()
        self.progress.step += 1
        self.progress.samples += len(planes)
        self.progress.cpu_s += time.process_time() - started
        return {name: float(loss.detach()) for name, loss in losses.items()}

    def losses(
        self, features: Tensor, wanted: dict[str, Tensor], known: Tensor
    ) -> dict[str, Tensor]:
        """Losses of (N, F) features against unit directions and beliefs."""
        found = {name: head(features) for name, head in self.heads.items()}
        losses = {
            name: 1 - functional.cosine_similarity(found[name], wanted[name]).mean()
            for name in FILES
        }
        for name, weights in (("names", torch.ones_like(known)), ("classes", known)):
            each = -(wanted[name] * found[name].log_softmax(dim=1)).sum(dim=1) * weights
            losses[name] = each.sum() / weights.sum().clamp(min=1.0)
        return losses

    def save(self, path: Path) -> None:
        """Write all of it; whole or not at all."""
        held = {
            "model": self.model.state_dict(),
            "average": self.average.state_dict(),
            "optimiser": self.optimiser.state_dict(),
            "progress": [getattr(self.progress, n) for n in Progress.__slots__],
        }
        part = path.with_suffix(".part")
        torch.save(held, part)
        part.replace(path)

    def keep(self, path: Path) -> None:
        """Write the average alone, as float16: small enough to outlive a machine in a commit."""
        from safetensors.torch import save_file

        held = {
            name: value.half().contiguous() if value.dtype.is_floating_point else value
            for name, value in self.average.state_dict().items()
        }
        save_file(held, path, {"samples": str(self.progress.samples)})

    def begin_with(self, path: Path) -> None:
        """Begin at an average that `keep` wrote; the optimiser starts afresh."""
        from safetensors.torch import load_file

        held = {
            name: value.float() if value.dtype.is_floating_point else value
            for name, value in load_file(path).items()
        }
        self.model.load_state_dict(held)
        self.average.load_state_dict(held)

    def load(self, path: Path) -> None:
        """Go on from a checkpoint."""
        held = torch.load(path, map_location="cpu", weights_only=True)
        self.model.load_state_dict(held["model"])
        self.average.load_state_dict(held["average"])
        self.optimiser.load_state_dict(held["optimiser"])
        self.progress = Progress(*held["progress"])

    def _rate(self) -> float:
        done = self.progress.step - self.progress.first
        left = 1.0 - done / self.plan.cool if self.plan.cool else 1.0
        return self.plan.rate * min(1.0, (self.progress.step + 1) / self.plan.warm_up) * left

    @torch.no_grad()
    def _average(self) -> None:
        keep = min(AVERAGE, self.progress.step / (self.progress.step + 20))
        pairs = zip(
            self.average.state_dict().values(), self.model.state_dict().values(), strict=True
        )
        for slow, fast in pairs:
            if slow.dtype.is_floating_point:
                slow.lerp_(fast, 1 - keep)
            else:
                slow.copy_(fast)


def is_bfloat16_fast() -> bool:
    """Time both precisions of a convolution: without bfloat16 a processor emulates it, slowly."""
    layer = nn.Conv2d(64, 64, 3, padding=1).to(memory_format=torch.channels_last)  # type: ignore[call-overload]
    given = torch.randn(8, 64, 24, 24).to(memory_format=torch.channels_last)

    def seconds(enabled: bool) -> float:
        with torch.no_grad(), torch.autocast("cpu", torch.bfloat16, enabled=enabled):
            layer(given)
            started = time.process_time()
            for _ in range(3):
                layer(given)
        return time.process_time() - started

    return seconds(enabled=True) < seconds(enabled=False)


def main() -> int:
    """Read the command line and train."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--pool", type=Path, required=True, help="folder of the pool")
    parser.add_argument("--run", type=Path, required=True, help="folder for checkpoint and basis")
    parser.add_argument("--begin", type=Path, help="run to branch from, or a kept average")
    parser.add_argument("--keep", type=Path, help="only write the run's average to this file")
    parser.add_argument("--cool", type=int, default=0, help="steps until the rate is zero")
    parser.add_argument("--side", type=int, default=96, help="px (%(default)s)")
    parser.add_argument("--save-s", type=float, default=120.0)
    chosen = parser.parse_args()
    torch.set_num_threads(1)
    chosen.run.mkdir(parents=True, exist_ok=True)
    own, begin = chosen.run / CHECKPOINT, chosen.begin
    if begin is not None and begin.is_dir() and not own.exists():
        shutil.copy(begin / BASIS, chosen.run / BASIS)
    pool = Pool(chosen.pool, chosen.run)
    run = Run(Plan(cool=chosen.cool, side=chosen.side), pool.names)
    if own.exists():
        run.load(own)
    elif begin is not None and begin.is_file():
        run.begin_with(begin)
    elif begin is not None:
        run.load(begin / CHECKPOINT)
        run.progress.first = run.progress.step
    if chosen.keep is not None:
        run.keep(chosen.keep)
        return 0
    train(run, pool, own, chosen.save_s)
    return 0


def train(run: Run, pool: Pool, path: Path, save_s: float = 120.0, most: int | None = None) -> None:
    """Train until the rate is zero (or `most` steps in all), saving now and then and at the end."""
    rng = np.random.default_rng([run.plan.seed, run.progress.step])
    saved, sums = time.monotonic(), dict[str, float]()
    while not run.is_done and (most is None or run.progress.step < most):
        rows = pool.draw(run.plan.batch, rng)
        planes = prepare(vary(pool.crops(rows), run.plan.side, rng))
        losses = run.learn(*mix(planes, *as_tensors(pool.targets(rows)), rng))
        sums = {name: sums.get(name, 0.0) + loss for name, loss in losses.items()}
        step = run.progress.step
        if step % REPORT_EVERY == 0:
            _report(run, **{name: value / REPORT_EVERY for name, value in sums.items()})
            sums = {}
        if step % LEFT_OUT_EVERY == 0:
            _report(run, crops=float(pool.refresh()), **left_out_scores(run, pool))
        elif step % REFRESH_EVERY == 0:
            pool.refresh()
        if time.monotonic() - saved > save_s:
            run.save(path)
            saved = time.monotonic()
    run.save(path)
    _report(run, **left_out_scores(run, pool))


@torch.no_grad()
def left_out_scores(run: Run, pool: Pool) -> dict[str, float]:
    """Cosine to each teacher and share of right classes of the average, on rows left out."""
    average = run.average.eval()
    rows = pool.left_out[:: max(1, len(pool.left_out) // LEFT_OUT_AT_MOST)]
    network: Network = average["network"]  # type: ignore[assignment]
    parts = [
        network.features(prepare(resize(pool.crops(rows[at : at + 64]), run.plan.side)))
        for at in range(0, len(rows), 64)
    ]
    features, targets = torch.cat(parts), pool.targets(rows)
    heads: nn.ModuleDict = average["heads"]  # type: ignore[assignment]
    scores = {
        f"left_out_{name}": float(
            functional.cosine_similarity(
                heads[name](features), torch.from_numpy(targets.directions[name])
            ).mean()
        )
        for name in FILES
    }
    known = targets.classes >= 0
    guesses = heads["classes"](features).argmax(dim=1).numpy()
    if known.any():
        scores["left_out_classes"] = float((guesses == targets.classes)[known].mean())
    return scores


def as_tensors(targets: Targets) -> tuple[dict[str, Tensor], Tensor]:
    """Return directions and beliefs by name, and (N,) 1 where the class is known."""
    classes = torch.from_numpy(targets.classes)
    hard = functional.one_hot(classes.clamp(min=0), len(CLASSES)).float()
    wanted = {name: torch.from_numpy(rows) for name, rows in targets.directions.items()}
    wanted["names"] = torch.from_numpy(targets.names)
    wanted["classes"] = hard * (1 - SMOOTHING) + SMOOTHING / len(CLASSES)
    return wanted, (classes >= 0).float()


def _report(run: Run, **figures: float) -> None:
    shown = {name: round(value, 4) for name, value in figures.items()}
    progress = {"step": run.progress.step, "samples": run.progress.samples}
    line = {**progress, "cpu_s": round(run.progress.cpu_s), **shown}
    sys.stderr.write(json.dumps(line) + "\n")
    sys.stderr.flush()


if __name__ == "__main__":
    sys.exit(main())

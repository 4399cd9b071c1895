"""`hapticvlm chart` and `stability`: what each method is worth, what it costs, what breaks it.

Wires the measurements to the training side (labels of the data folder, networks in torch), which
they do not import. Another subject is one more function beside `_add_material`.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hapticvlm.commands.parsing import add_json
from hapticvlm_lab.commands import chart_ambient, chart_safety, chart_thermal, chart_vibration

if TYPE_CHECKING:
    from hapticvlm.commands.parsing import Commands
    from hapticvlm.recognition.encoders.encoder import Encoder
    from hapticvlm_lab.bench.material.data import Labels, Where
    from hapticvlm_lab.bench.material.methods import Wiring
    from hapticvlm_lab.training.network import Network

LIMIT = 640  # pictures of a source that `chart` uses
SHAKEN = 64  # pictures of a source that `stability` uses
WEIGHTS = "encoder.safetensors"
COURSE = "course.csv"  # of the shipped encoder's training: samples and accuracies
OF_SHIPPED = Path(__file__).parents[1] / "training"  # the weights of the encoder that ships
SEED = 7  # of the untrained network


def add(commands: Commands) -> None:
    """Declare the commands, with a subject each."""
    chart = commands.add_parser("chart", help="draw accuracy against latency, every method")
    subjects = chart.add_subparsers(title="subjects", required=True, metavar="WHAT")
    material = _add_material(subjects, _chart_material, ("chart-output", LIMIT))
    material.add_argument(
        "--variants", type=Path, help="folder of further encoders, one a sub-folder"
    )
    material.add_argument(
        "--encoder",
        action="append",
        metavar="NAME",
        help="network to chart as `serve --encoder` reads it, repeatable (those of the data)",
    )
    beliefs = subjects.add_parser("beliefs", help="what is said and felt of pictures, and learned")
    beliefs.set_defaults(run=_chart_beliefs)
    beliefs.add_argument("--data", type=Path, help="labelled data (../shared/data if there)")
    beliefs.add_argument(
        "--out",
        type=Path,
        default=Path("chart-output"),
        metavar="FOLDER",
        help="folder to write to (%(default)s)",
    )
    chart_thermal.add_chart(subjects)
    chart_ambient.add_chart(subjects)
    chart_safety.add(subjects)
    chart_vibration.add(subjects)
    stability = commands.add_parser("stability", help="draw what makes a method fail")
    subjects = stability.add_subparsers(title="subjects", required=True, metavar="WHAT")
    _add_material(subjects, _shake_material, ("chart-output", SHAKEN))
    chart_thermal.add_stability(subjects)


def _add_material(
    subjects: Commands,
    run: Callable[[argparse.Namespace], int],
    defaults: tuple[str, int],
) -> argparse.ArgumentParser:
    material = subjects.add_parser("material", help="pictures to materials, per held-back source")
    material.set_defaults(run=run)
    material.add_argument("--data", type=Path, help="labelled data (../shared/data if there)")
    material.add_argument(
        "--capture",
        type=Path,
        action="append",
        metavar="DIR",
        help="graded capture to look at, repeatable (those in examples/)",
    )
    material.add_argument(
        "--out",
        type=Path,
        default=Path(defaults[0]),
        metavar="FOLDER",
        help="write picture and JSON here (%(default)s)",
    )
    material.add_argument(
        "--limit", type=int, default=defaults[1], help="pictures a source, 0: all (%(default)s)"
    )
    add_json(material)
    return material


def _chart_material(options: argparse.Namespace) -> int:
    from hapticvlm_lab.bench.material import chart

    where = _where(options)
    named = tuple(options.encoder or _networks(where.data))
    plan = chart.Plan(where, named, options.variants, options.out, options.json)
    return _into_folder(options, lambda: chart.run(plan, _wiring()))


def _chart_beliefs(options: argparse.Namespace) -> int:
    from hapticvlm_lab.bench.material import belief_chart
    from hapticvlm_lab.bench.names import SIBLING

    folder = options.data or SIBLING
    data = folder if (folder / "labels.csv").is_file() else None
    course = OF_SHIPPED / COURSE
    return _into_folder(options, lambda: belief_chart.run(data, labels(), course, options.out))


def _shake_material(options: argparse.Namespace) -> int:
    from hapticvlm_lab.bench.material import stability

    plan = stability.Plan(_where(options), options.out, options.json)
    return _into_folder(options, lambda: stability.run(plan, labels()))


def _into_folder(options: argparse.Namespace, run: Callable[[], int]) -> int:
    """Run with the result folder made."""
    import matplotlib  # noqa: F401

    options.out.mkdir(parents=True, exist_ok=True)
    return run()


def _where(options: argparse.Namespace) -> Where:
    from hapticvlm_lab.bench.material.data import Where
    from hapticvlm_lab.bench.material.reading import default_captures
    from hapticvlm_lab.bench.names import SIBLING

    folder = options.data or SIBLING
    data = folder if (folder / "labels.csv").is_file() else None
    captures = tuple(options.capture) if options.capture else default_captures()
    return Where(captures, data, options.limit)


def labels() -> Labels:
    """Return what the data folder's labels mean."""
    from hapticvlm_lab.bench.material.data import Labels
    from hapticvlm_lab.training import sources

    return Labels(
        sources.LABELLED,
        sources.CALIBRATION,
        sources.material_of,
        sources.is_tile_held_back,
        sources.LIVING_HELD_BACK,
    )


def _wiring() -> Wiring:
    from hapticvlm_lab.bench.material.methods import Wiring

    return Wiring(labels(), _eager, _untrained)


def _networks(data: Path | None) -> list[str]:
    """List the ImageNet networks of the data folder."""
    return [] if data is None else sorted(map(str, data.glob("teacher/*.tflite")))


def _eager(folder: Path | None) -> Encoder:
    """Load the same net in torch eager, from the weights beside its graph. Raises EncoderError."""
    from hapticvlm.recognition.encoders.encoder import CARD, SHIPPED, EncoderError

    weights, place = folder or OF_SHIPPED, folder or SHIPPED
    if not (weights / WEIGHTS).is_file() or not (place / CARD).is_file():
        raise EncoderError(f"no {WEIGHTS} for {CARD} in {place.name}")
    return _in_torch("torch eager", _card(place), lambda: _read_network(weights))


def _untrained() -> Encoder:
    """Make the shipped architecture with random weights. Raises EncoderError."""
    from hapticvlm.recognition.encoders.encoder import CARD, SHIPPED

    card: dict[str, Any] = {"side": 128, "shape": {}}
    card = _card(SHIPPED) if (SHIPPED / CARD).is_file() else card
    return _in_torch("untrained", card, lambda: _random_network(card["shape"]))


def _card(place: Path) -> dict[str, Any]:
    from hapticvlm.recognition.encoders.encoder import CARD

    card: dict[str, Any] = json.loads((place / CARD).read_text(encoding="utf-8"))
    return card


def _read_network(place: Path) -> Network:
    from hapticvlm_lab.training import export

    return export.read(place)


def _random_network(shape: dict[str, Any]) -> Network:
    import torch

    from hapticvlm_lab.training.network import Network, Shape

    torch.manual_seed(SEED)
    return Network(Shape(**shape)).eval()


def _in_torch(name: str, card: dict[str, Any], make: Callable[[], Network]) -> Encoder:
    """Wrap a training network, run by torch on one thread, as an encoder. Raises EncoderError."""
    from hapticvlm.recognition.encoders.encoder import EncoderError
    from hapticvlm_lab.bench.material import baselines

    try:
        import torch

        torch.set_num_threads(1)
        network = make()
    except (ImportError, RuntimeError, TypeError, KeyError) as error:
        raise EncoderError(f"{error}".splitlines()[0]) from None

    def forward(pixels: Any) -> Any:  # noqa: ANN401 - arrays in, arrays out
        with torch.inference_mode():
            return network(torch.from_numpy(pixels)).numpy()

    return baselines.Network(name, card["side"], network.shape.dimension, forward)

"""`hapticvlm study match`: asks how strong cold must be, against a block of real steel."""

from __future__ import annotations

import argparse
import asyncio
import json
import statistics
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hapticvlm import documents
from hapticvlm.commands import service_address
from hapticvlm.commands.parsing import number_within
from hapticvlm.errors import UsageError, shell_word

if TYPE_CHECKING:
    from hapticvlm.client import Client
    from hapticvlm.commands.parsing import Commands
    from hapticvlm_studio.trials.player import Player

_DESCRIPTION = """
Ask a person how strong cold must be. The palm rests on a block of steel of the room's temperature,
then on the plate of a running service, which plays steel for three seconds. The person moves the
plate's strength, in percent, until both feel alike: four times, from strong and from weak in turn.
FILE keeps everybody's matches; run the command once for each person. It takes a block of 5 cm and
more that lay in the room for an hour.
"""
STARTS = (1.0, 0.4, 1.0, 0.4)  # of the matches; our choice: an end that is approached biases it
# Of a presentation, of the palm on the neutral plate before it, and of the wait for that plate; how
# near to neutral it must be, degC. Our choice, as in a study.
FELT_S, REST_S, LONGEST_S, SETTLE_C = 3.0, 6.0, 60.0, 0.8
STEEL = "steel block"


def add(parts: Commands) -> None:
    """Declare `study match`."""
    match = parts.add_parser(
        "match",
        help="ask how strong cold must be, against a block of steel",
        description=_DESCRIPTION,
        examples=("hapticvlm study match cold.json --participant P-01 --room 22",),
    )
    match.set_defaults(run=_match)
    match.add_argument("file", type=Path, metavar="FILE", help="the matches of everybody")
    match.add_argument("--participant", required=True, metavar="CODE", help="code of the person")
    match.add_argument(
        "--room",
        type=number_within(10.0, 28.0),
        default=22.0,
        metavar="DEGC",
        help="temperature of room and block (%(default)s)",
    )
    service_address.add_url(match)


def _match(options: argparse.Namespace) -> int:
    from hapticvlm_studio.design.design import check_code

    check_code(options.participant)
    kept = _kept(options.file)
    if options.participant in kept["matches"]:
        raise UsageError(f"{options.file} has {options.participant} already; give another code")
    try:
        strengths, simulated = asyncio.run(_ask(options))
    except EOFError:
        raise UsageError("no more answers: nothing was kept") from None
    kept["matches"][options.participant] = strengths
    kept["simulated"] |= simulated
    people = [statistics.geometric_mean(each) for each in kept["matches"].values()]
    kept["thermal_strength"] = round(statistics.median(people), 3)
    # Shown first, so that a disk that refuses the file does not lose what the person said.
    print(f"{options.participant}: {', '.join(f'{100 * each:.0f} %' for each in strengths)}")
    documents.replace_file(options.file, json.dumps(kept, indent=1) + "\n")
    print(f"{len(people)} people, median {100 * kept['thermal_strength']:.0f} %")
    if kept["simulated"]:
        print("simulated: nobody felt the plate, do not use it")
    print(f"to use it: hapticvlm serve --thermal-strength {shell_word(options.file)}")
    return 0


def _kept(path: Path) -> dict[str, Any]:
    """Return what FILE holds. Raises UsageError for another file."""
    new = {"calibrate": "cold", "simulated": False, "matches": {}, "thermal_strength": 1.0}
    if not path.exists():
        return new
    try:
        kept = documents.read_json(path, dict[str, Any])
    except ValueError:
        kept = {}
    if kept.keys() != new.keys() or kept["calibrate"] != "cold":
        raise UsageError(f"{path} is not what `hapticvlm study match` writes; give another file")
    return kept


async def _ask(options: argparse.Namespace) -> tuple[list[float], bool]:
    """Return the strengths that the person finds, and whether the plate was simulated.

    Their mean is that of the running service from then on.
    """
    from hapticvlm.client import connect
    from hapticvlm_studio.trials.player import NEUTRAL, Player, PresentationError

    things = [
        {"object_id": name, "material": "metal", "temperature_c": celsius}
        for name, celsius in ((STEEL, options.room), (NEUTRAL.name, NEUTRAL.object_c))
    ]
    try:
        with service_address.reaching(options.url):
            async with connect(options.url, name="study match") as client:
                await client.set(ownership="take")  # of a scene that touches nothing
                await client.scene(things, ambient_c=options.room)
                player = Player(client, SETTLE_C)
                listening = asyncio.create_task(player.listen())
                try:
                    found = [await _one(client, player, *each) for each in enumerate(STARTS, 1)]
                finally:
                    listening.cancel()
                    await asyncio.gather(listening, return_exceptions=True)
                await client.set(thermal_gain=statistics.geometric_mean(found))
                return found, bool(client.welcome["devices"]["peltier"]["simulated"])
    except PresentationError as error:
        raise UsageError(f"{error}; no answer of {options.participant} was kept") from None


async def _one(client: Client, player: Player, number: int, strength: float) -> float:
    """Let the person move the strength until plate and block feel alike."""
    while True:
        shown = f"match {number} at {100 * strength:.0f} %"
        todo = "feel the block, press Enter, then rest the palm on the plate until asked"
        await _read(f"{shown}: {todo} ")
        await player.settle(REST_S, LONGEST_S)
        await client.set(thermal_gain=strength)
        async with client.touching(STEEL, speed_mps=0.0):
            await asyncio.sleep(FELT_S)
        said = await _read("  alike (Enter), or another strength in percent, 5 to 100? ")
        if not said:
            return strength
        if said.isdecimal() and 5 <= int(said) <= 100:
            strength = int(said) / 100.0


async def _read(question: str) -> str:
    """Ask on standard error. Raises EOFError."""
    print(question, end="", file=sys.stderr, flush=True)
    return (await asyncio.to_thread(input)).strip()

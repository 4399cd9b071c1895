"""Crops that come together are embedded together, and nobody waits for the work of another."""

import asyncio

import pytest

from hapticvlm_recogniser_app.batches import Batches


class Work:
    """Doubles numbers, a batch at a time, and keeps the batches; -1 cannot be doubled."""

    def __init__(self) -> None:
        self.batches: list[list[int]] = []
        self.may_go_on = asyncio.Event()
        self.may_go_on.set()

    async def __call__(self, things):
        self.batches.append(list(things))
        await self.may_go_on.wait()
        if -1 in things:
            raise ValueError("-1 cannot be doubled")
        return [2 * thing for thing in things]


async def test_what_comes_while_a_batch_is_under_way_makes_the_next_one():
    work = Work()
    batches = Batches(work, 4)
    work.may_go_on.clear()
    first = asyncio.create_task(batches.put(0))
    await asyncio.sleep(0)
    await asyncio.sleep(0)
    later = [asyncio.create_task(batches.put(number)) for number in range(1, 7)]
    await asyncio.sleep(0)
    work.may_go_on.set()
    assert list(await asyncio.gather(first, *later)) == [0, 2, 4, 6, 8, 10, 12]
    assert work.batches == [[0], [1, 2, 3, 4], [5, 6]]


async def test_an_error_reaches_those_of_its_batch_and_nobody_else():
    work = Work()
    batches = Batches(work, 1)
    bad = asyncio.create_task(batches.put(-1))
    good = asyncio.create_task(batches.put(3))
    with pytest.raises(ValueError, match="cannot be doubled"):
        await bad
    assert await good == 6


async def test_who_leaves_takes_nothing_from_the_others_of_its_batch():
    work = Work()
    work.may_go_on.clear()
    batches = Batches(work, 4)
    tasks = [asyncio.create_task(batches.put(number)) for number in (1, 2)]
    await asyncio.sleep(0)
    tasks[0].cancel()
    work.may_go_on.set()
    assert await tasks[1] == 4

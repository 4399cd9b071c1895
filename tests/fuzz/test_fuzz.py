"""Every kind of input from strangers, fuzzed for a moment; `make fuzz` is the long run."""

from each_case import each
from run import fuzz
from targets import TARGETS

SECONDS, COUNT = 1.0, 3000


@each(name=TARGETS)
def test_hostile_input_ends_in_an_error_that_is_declared(name):
    done, _, found = fuzz(name, seed=1, seconds=SECONDS, count=COUNT)
    assert not found, found[0]
    assert done > 20

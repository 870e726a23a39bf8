"""The choice among changes of a patch: the fewest faults, the first of the source among equals."""

from types import SimpleNamespace

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from anisomesh.meshops import engine
from conftest import examples


class Counts:
    """An objective with a known number of faults before and after each change, and lower bounds of them."""

    def __init__(self, before, after, slack):
        self.before, self.after, self.bounds = before, after, np.maximum(np.array(after, dtype=int) - slack, 0)

    def count(self, _):
        return self.before

    def bounds_after(self, _, changes):
        return self.bounds[[change.number for change in changes]]

    def count_after(self, _, change, bound):
        assert bound == self.bounds[change.number]
        return self.after[change.number]


@examples(200)
@given(
    before=st.integers(0, 4),
    after=st.lists(st.integers(0, 5), max_size=12),
    seed=st.integers(0, 2**32 - 1),
    allow_equal=st.booleans(),
)
def test_the_best_sound_change_is_found_and_the_first_among_equals(before, after, seed, allow_equal):
    """Regression: bounds decided among equals, so that large moves went before flips."""
    rng = np.random.default_rng(seed)
    sound = rng.random(len(after)) < 0.7
    changes = [SimpleNamespace(number=k, sound=bool(sound[k])) for k in range(len(after))]
    objective = Counts(before, after, rng.integers(0, 3, len(after)))
    limit = before + allow_equal
    wanted = min(((after[k], k) for k in range(len(after)) if sound[k] and after[k] < limit), default=None)
    original, engine.is_sound = engine.is_sound, lambda _, change: change.sound
    try:
        found = engine._best_change(None, lambda _: changes, objective, allow_equal=allow_equal)
    finally:
        engine.is_sound = original
    assert (found and (after[found.number], found.number)) == wanted

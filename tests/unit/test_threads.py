"""Work shared by threads: results in order, every item once, errors raised."""

import threading
import time

import numpy as np
import pytest

from anisomesh.execution.threads import Workers, blocks


@pytest.mark.parametrize("threads", [1, 2, 5])
@pytest.mark.parametrize("n", [0, 1, 3, 100])
def test_results_come_in_the_order_of_the_items(threads, n):
    workers = Workers(threads)
    for _ in range(3):
        assert workers.map(lambda thread, item: (item, 0 <= thread < threads), range(n)) == [
            (k, True) for k in range(n)
        ]


def test_no_thread_number_is_used_twice_at_a_time():
    busy = [threading.Lock() for _ in range(3)]

    def work(thread, item):
        assert busy[thread].acquire(blocking=False)
        time.sleep(0.002)
        busy[thread].release()

    Workers(3).map(work, range(30))


@pytest.mark.parametrize("bad", [0, 1, 7])
def test_an_error_in_any_thread_is_raised(bad):
    def work(thread, item):
        time.sleep(0.001)
        if item == bad:
            raise ValueError(item)

    workers = Workers(2)
    with pytest.raises(ValueError, match=str(bad)):
        workers.map(work, range(8))
    assert workers.map(lambda thread, item: item, range(4)) == [0, 1, 2, 3]


@pytest.mark.parametrize("n", [0, 1, 6, 7])
def test_blocks_have_all_items_in_order_and_all_but_the_last_have_the_size(n):
    parts = blocks(np.arange(n), 3)
    assert np.concatenate(parts).tolist() == list(range(n))
    assert all(len(part) == 3 for part in parts[:-1])
    assert len(parts[-1]) <= 3

"""A heap of edges, the cheapest first, in arrays of fixed size."""

from typing import Any, NamedTuple

from .compiled import kernel


class EdgeHeap(NamedTuple):
    """Arrays of a heap; its size is passed beside it.

    Attributes
    ----------
    costs
        Costs (n,).
    ends
        Two points for each entry (n, 2).
    made
        A time at which each entry was made (n,).
    """

    costs: Any
    ends: Any
    made: Any


@kernel
def _swap(heap, i, j):
    """Exchange two entries."""
    costs, ends, made = heap.costs, heap.ends, heap.made
    costs[i], costs[j] = costs[j], costs[i]
    made[i], made[j] = made[j], made[i]
    for end in range(2):
        ends[i, end], ends[j, end] = ends[j, end], ends[i, end]


@kernel
def push(heap, size, cost, p, q, now):
    """Enter the edge p q into a heap of this size, if there is room, and return the size."""
    if size == len(heap.costs):
        return size
    heap.costs[size] = cost
    heap.ends[size, 0], heap.ends[size, 1], heap.made[size] = p, q, now
    k = size
    while k > 0 and heap.costs[k] < heap.costs[(k - 1) // 2]:
        _swap(heap, k, (k - 1) // 2)
        k = (k - 1) // 2
    return size + 1


@kernel
def pop(heap, size):
    """Move the cheapest entry of a heap of this size behind its new end, which is returned."""
    last = size - 1
    _swap(heap, 0, last)
    k = 0
    while 2 * k + 1 < last:
        child = 2 * k + 1
        if child + 1 < last and heap.costs[child + 1] < heap.costs[child]:
            child += 1
        if not heap.costs[child] < heap.costs[k]:
            break
        _swap(heap, k, child)
        k = child
    return last

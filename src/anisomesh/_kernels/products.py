"""Products of tables with small matrices, with sums in a fixed order."""

from .compiled import kernel


@kernel
def add_product(x, weight, out):
    """Add x weight to ``out``: (V, K) times (K, C) onto (V, C), term after term, so that results depend on no library.

    Four terms at a time, so that a row is read and written a quarter as often.
    """
    n_terms, channels = weight.shape
    whole = n_terms - n_terms % 4
    for i in range(x.shape[0]):
        for k in range(0, whole, 4):
            first, second, third, fourth = x[i, k], x[i, k + 1], x[i, k + 2], x[i, k + 3]
            for c in range(channels):
                total = out[i, c] + first * weight[k, c]
                total = total + second * weight[k + 1, c]
                total = total + third * weight[k + 2, c]
                out[i, c] = total + fourth * weight[k + 3, c]
        for k in range(whole, n_terms):
            value = x[i, k]
            for c in range(channels):
                out[i, c] += value * weight[k, c]

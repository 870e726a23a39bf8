"""Networks, with their input graphs, message passing, files of weights, and devices.

``graph`` and ``hierarchy`` turn a surface into the input of the default network, :mod:`.stretch`; ``paper`` has the
network of the paper with its input. ``messages`` has the message passing of both, ``checkpoint`` reads and writes them.
"""

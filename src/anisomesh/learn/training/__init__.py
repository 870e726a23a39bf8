"""Training of networks: ``train`` is the entry point, and ``config`` reads its options.

``tasks`` has the examples and losses of each network, ``losses`` the loss functions, ``run`` the steps, checkpoints and
validation of a run, ``processes`` training in parallel, ``events`` the log for TensorBoard.
"""

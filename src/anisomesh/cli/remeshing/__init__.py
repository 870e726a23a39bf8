"""``anisomesh remesh``: the command, and the metric that its options prescribe."""

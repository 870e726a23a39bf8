"""From any triangle soup to oriented manifold surfaces."""

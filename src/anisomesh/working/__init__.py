"""The working surface: even triangles near the input, on which the metric is measured and sites move."""

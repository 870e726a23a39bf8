"""Principal curvatures and the metric tensors made of them."""

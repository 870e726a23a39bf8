"""Principal curvatures, metric tensors, line fields, and quality and transfer of a metric."""

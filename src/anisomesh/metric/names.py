"""Names of the built-in metrics, in a module that imports nothing, for the command line."""

from typing import Literal, get_args

MetricName = Literal["curvature", "approximation", "uniform"]
METRIC_NAMES: tuple[MetricName, ...] = get_args(MetricName)

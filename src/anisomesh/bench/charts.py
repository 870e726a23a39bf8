"""Chart of a suite: distance against triangle quality; better methods are lower and further to the right."""

from __future__ import annotations

import io
from collections.abc import Sequence
from itertools import product
from typing import Any

import numpy as np

from anisomesh.bench.disturb import CLEAN
from anisomesh.bench.runs import RunRow, select_rows
from anisomesh.bench.suite import Suite

_PANEL_INCHES = (3.6, 3.4)
_LEGEND_INCHES = 2.2
_METHOD_MARKERS = "osD^v<>Ph*Xd"
_MIN_CHART_DISTANCE = 1e-12  # diagonals; below it a distance is rounding, and has no place on a logarithmic axis


def trade_off(suite: Suite, rows: Sequence[RunRow]) -> str:
    """Return a chart as SVG with a panel per input and ratio and a mark per method, empty without results.

    Shows the geometric mean over meshes and seeds of the RMS distance, at bounding-box diagonal 1, against the mean
    quality G. Zero distances are left out: the axis is logarithmic.

    Raises
    ------
    ImportError
        If matplotlib is not installed.
    """
    from matplotlib.backends.backend_svg import FigureCanvasSVG
    from matplotlib.figure import Figure

    points = {key: _points(suite, rows, *key) for key in product(suite.inputs, suite.ratios)}
    points = {key: found for key, found in points.items() if found}
    if not points:
        return ""
    figure: Any = Figure(
        figsize=(_PANEL_INCHES[0] * len(points) + _LEGEND_INCHES, _PANEL_INCHES[1]), layout="constrained"
    )
    FigureCanvasSVG(figure)
    panels = figure.subplots(1, len(points), squeeze=False, sharey=True)[0]
    for panel, ((input_name, ratio), found) in zip(panels, points.items(), strict=True):
        for number, method in enumerate(suite.methods):
            if method.name in found:
                style = {"marker": _METHOD_MARKERS[number % len(_METHOD_MARKERS)], "color": f"C{number % 10}", "s": 45}
                panel.scatter(*found[method.name], label=method.name, **style)
        panel.set_yscale("log")
        panel.set_title(
            f"{ratio:.0%} of the vertices" + (f", {input_name}" if input_name != CLEAN else ""), fontsize=11
        )
        panel.set_xlabel("mean quality G")
        panel.grid(which="both", color="#e6e6e6", linewidth=0.6)
        panel.set_axisbelow(True)
    panels[0].set_ylabel("RMS distance / diagonal")
    marks = {label: mark for panel in panels for mark, label in zip(*panel.get_legend_handles_labels(), strict=True)}
    figure.legend(marks.values(), marks.keys(), loc="outside right center", frameon=False, fontsize=9)
    text = io.StringIO()
    figure.savefig(text, format="svg", metadata={"Date": None})
    return text.getvalue()


def _points(suite: Suite, rows: Sequence[RunRow], input_name: str, ratio: float) -> dict[str, tuple[float, float]]:
    """Return mean quality and mean distance of each method that has results for an input at a ratio."""
    found = {}
    for method in suite.methods:
        done = [
            row["evaluation"] for row in select_rows(rows, input_name, ratio, method.name) if row["status"] == "done"
        ]
        distances = np.array([evaluation["distance"]["rms"] for evaluation in done])
        distances = distances[distances > _MIN_CHART_DISTANCE]
        if len(distances):
            quality = float(np.mean([evaluation["shape"]["g_mean"] for evaluation in done]))
            found[method.name] = quality, float(np.exp(np.log(distances).mean()))
    return found

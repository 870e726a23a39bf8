"""A chart of a suite: distance against triangle quality, where a method wants to be low and to the right."""

from __future__ import annotations

import io
from collections.abc import Sequence
from itertools import product
from typing import Any

import numpy as np

from anisomesh.bench.disturb import CLEAN
from anisomesh.bench.runs import RunRow, chosen
from anisomesh.bench.suite import Suite

_PANEL = (3.6, 3.4)  # inches
_MARKERS = "osD^v<>Ph*Xd"


def trade_off(suite: Suite, rows: Sequence[RunRow]) -> str:
    """Return a chart as SVG: one panel an input and ratio, one mark a method, empty if there is nothing to show.

    The geometric mean over meshes and seeds of the root mean square distance, against the mean quality G. Distances
    that are zero, as of methods that change nothing at 100 %, have no place on the logarithmic axis and are left out.

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
    figure: Any = Figure(figsize=(_PANEL[0] * len(points) + 2.2, _PANEL[1]), layout="constrained")
    FigureCanvasSVG(figure)
    panels = figure.subplots(1, len(points), squeeze=False, sharey=True)[0]
    for panel, ((given, ratio), found) in zip(panels, points.items(), strict=True):
        for number, method in enumerate(suite.methods):
            if method.name in found:
                style = {"marker": _MARKERS[number % len(_MARKERS)], "color": f"C{number % 10}", "s": 45}
                panel.scatter(*found[method.name], label=method.name, **style)
        panel.set_yscale("log")
        panel.set_title(f"{ratio:.0%} of the vertices" + (f", {given}" if given != CLEAN else ""), fontsize=11)
        panel.set_xlabel("mean quality G")
        panel.grid(which="both", color="#e6e6e6", linewidth=0.6)
        panel.set_axisbelow(True)
    panels[0].set_ylabel("RMS distance / diagonal")
    marks = {label: mark for panel in panels for mark, label in zip(*panel.get_legend_handles_labels(), strict=True)}
    figure.legend(marks.values(), marks.keys(), loc="outside right center", frameon=False, fontsize=9)
    text = io.StringIO()
    figure.savefig(text, format="svg", metadata={"Date": None})
    return text.getvalue()


def _points(suite: Suite, rows: Sequence[RunRow], given: str, ratio: float) -> dict[str, tuple[float, float]]:
    """Return mean quality and mean distance of each method that has results for an input at a ratio."""
    found = {}
    for method in suite.methods:
        done = [row["evaluation"] for row in chosen(rows, given, ratio, method.name) if row["status"] == "done"]
        distances = np.array([evaluation["distance"]["rms"] for evaluation in done])
        distances = distances[distances > 1e-12]
        if len(distances):
            quality = float(np.mean([evaluation["shape"]["g_mean"] for evaluation in done]))
            found[method.name] = quality, float(np.exp(np.log(distances).mean()))
    return found

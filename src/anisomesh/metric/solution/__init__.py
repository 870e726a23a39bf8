"""The metric that adapts a mesh to a function at its vertices, such as the solution of a simulation."""

from anisomesh.metric.solution.source import SolutionMetric

__all__ = ["SolutionMetric"]

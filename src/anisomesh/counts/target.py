"""How many vertices are asked for: as a number, as a share of the input's, or by a distance."""

from __future__ import annotations

import math
from collections.abc import Iterable

from anisomesh._values import real_number, whole_number
from anisomesh.errors import OptionError
from anisomesh.options import MIN_VERTICES, RemeshOptions

_LARGEST_RATIO = 1e12  # vertices per vertex of the input; more is a mistake


def read_target(
    n_vertices: object, ratio: object, max_error: object, options: RemeshOptions
) -> tuple[int | None, float | None, float | None]:
    """Return the one of the three that is given, as a number in range, and None for the others.

    All are None if the options have an edge length, or a size field or tensors and none is given.
    """
    targets = {"n_vertices": n_vertices, "ratio": ratio, "max_error": max_error, "edge_length": options.edge_length}
    names = [name for name, value in targets.items() if value is not None]
    given = n_vertices is not None or ratio is not None or max_error is not None
    if len(names) > 1 or not (given or options.absolute_length is not None):
        are_given = f"{' and '.join(names)} are given; " if names else ""
        raise OptionError(f"{are_given}give one of n_vertices, ratio, max_error and edge_length")
    if not given:
        if options.density is not None:
            raise OptionError("a density has no unit; give n_vertices or ratio beside it")
        return None, None, None
    if n_vertices is not None:
        return whole_number("n_vertices", n_vertices, MIN_VERTICES), None, None
    if max_error is not None:
        length = real_number("max_error", max_error)
        if not (math.isfinite(length) and length > 0.0):
            raise OptionError(f"max_error = {length}; expected a positive length in model units")
        return None, None, length
    return None, _share("ratio", ratio), None


def read_levels(
    n_vertices: object, ratios: object, options: RemeshOptions
) -> tuple[list[int] | None, list[float] | None]:
    """Return the numbers of vertices of levels of detail, or their ratios, whichever is given, as numbers in range."""
    if (n_vertices is None) == (ratios is None):
        raise OptionError("give the levels either as n_vertices or as ratios, such as ratios=[1, 0.5, 0.2]")
    if options.edge_length is not None:
        raise OptionError("edge_length says how many vertices one mesh has; leave it out with levels of detail")
    name, values = ("n_vertices", n_vertices) if ratios is None else ("ratios", ratios)
    if isinstance(values, str) or not isinstance(values, Iterable):
        raise OptionError(f"{name} = {values!r}; expected a list with a number for each level")
    listed = list(values)
    if not listed:
        raise OptionError(f"{name} is empty; expected a number for each level")
    if ratios is None:
        return [whole_number(f"{name}[{k}]", value, MIN_VERTICES) for k, value in enumerate(listed)], None
    return None, [_share(f"{name}[{k}]", value) for k, value in enumerate(listed)]


def _share(name: str, value: object) -> float:
    """Return a number as vertices per vertex of the input, or raise OptionError."""
    share = real_number(name, value)
    if not 0.0 < share <= _LARGEST_RATIO:
        raise OptionError(f"{name} = {share}; expected a positive number, such as 0.2 for a fifth of the vertices")
    return share

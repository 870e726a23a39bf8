"""The recipe of a data set, in a module that imports no numerics, for the command line."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, get_args

from anisomesh.errors import OptionError

VariantName = Literal["given", "decimated", "stretched"]
EveningName = Literal["cvt", "tetwild", "working"]
VARIANTS: tuple[VariantName, ...] = get_args(VariantName)
EVENINGS: tuple[EveningName, ...] = get_args(EveningName)


@dataclass(frozen=True, kw_only=True)
class Recipe:
    """How items are made.

    Attributes
    ----------
    target
        Approximate number of points of the even mesh of a shape.
    variants
        Other meshes of each shape: ``"given"``, the input mesh as a remesh works on it, if its triangles are good
        enough; ``"decimated"``, by quadric edge collapses, with irregular triangles; ``"stretched"``, with triangles
        stretched in a random direction that is unrelated to the curvature.
    evening
        How an input mesh is made even unless it is: ``"cvt"``, a remesh with the uniform metric, ``"tetwild"``, the
        same on the boundary of pytetwild's tetrahedral mesh (the preparation of the paper), or ``"working"``: only bad
        triangles are made anew and long edges split, as for a remesh.
    max_residual
        Largest relative residual of the direct embedding.
    min_stretch
        Least mean stretch; shapes with less are flat or round everywhere.
    iterations
        Iterations of the direct embedding.
    """

    target: int = 5_000
    variants: tuple[str, ...] = VARIANTS
    evening: EveningName = "cvt"
    max_residual: float = 0.4
    min_stretch: float = 1.05
    iterations: int = 30

    def __post_init__(self) -> None:
        if self.target < 100:
            raise OptionError(f"target = {self.target}; expected at least 100 points")
        for name in self.variants:
            if name not in VARIANTS:
                raise OptionError(f"variant {name!r} is unknown; expected some of {', '.join(VARIANTS)}")
        if self.evening not in EVENINGS:
            raise OptionError(f"evening = {self.evening!r}; expected one of {', '.join(EVENINGS)}")

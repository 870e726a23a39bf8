"""The optimisation of the sites: random start, Lloyd's algorithm, features, L-BFGS, relocation."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np

from anisomesh._arrays import EmbeddedPoints, PointScalars, Sites
from anisomesh.cvt.constraints import ConstrainedSites, snap_to_features, spread_on_features
from anisomesh.cvt.energy import Energy, NormalMetric
from anisomesh.cvt.lbfgs import DescentOptions, Optimised, Status, minimise
from anisomesh.cvt.lloyd import lloyd
from anisomesh.cvt.relocation import relocate_to_creases, relocate_to_missed_points
from anisomesh.cvt.sampling import resample_by_energy, sample_surface
from anisomesh.execution.deadline import NO_DEADLINE, Deadline
from anisomesh.execution.progress import OnStep, StepInfo, ignore_steps
from anisomesh.features.network import FeatureNetwork
from anisomesh.voronoi.diagram import Diagram
from anisomesh.voronoi.restricted import RestrictedVoronoi

_RELOCATE_AT = 0.6  # share of the iterations after which sites are relocated; heuristic
_FIRST_CREASE_ROUNDS = 3  # in which sites are brought to creases at the start; later in one; heuristic


@dataclass(frozen=True, kw_only=True)
class CVTOptions:
    """How sites are optimised.

    Attributes
    ----------
    energy
        What is minimised.
    final_energy
        If given, the optimisation ends with this energy, for half as many iterations more.
    resampling_energy
        If given, sites are sampled anew between Lloyd steps, denser where cells have more of this energy.
    relocate
        Whether sites are moved to places that the dual mesh misses; needs feedback of the dual.
    lloyd_iterations, max_iterations
        Steps of Lloyd's algorithm at the start, and the bound on iterations of L-BFGS.
    seed
        Seed of the random start.
    """

    energy: Energy = field(default_factory=NormalMetric)
    final_energy: Energy | None = None
    resampling_energy: Energy | None = None
    relocate: bool = True
    lloyd_iterations: int = 9
    max_iterations: int = 150
    seed: int = 0

    @property
    def stages(self) -> list[tuple[Energy, int]]:
        """Energies and bounds on iterations of the runs of L-BFGS."""
        stages = [(self.energy, self.max_iterations)]
        if self.relocate:
            before = round(_RELOCATE_AT * self.max_iterations)
            stages = [(self.energy, before), (self.energy, self.max_iterations - before)]
        if self.final_energy is not None:
            stages.append((self.final_energy, self.max_iterations // 2))
        return stages


@dataclass(frozen=True)
class DualFeedback:
    """What the dual mesh of a diagram tells about its sites, as functions.

    Attributes
    ----------
    squared_errors
        From a diagram to the squared distance of each point of the surface to the dual (V,), None if it has no face.
    missing_on_creases
        From features and a diagram to places on creases that lack a site (m, d), most important first.
    """

    squared_errors: Callable[[Diagram], PointScalars | None]
    missing_on_creases: Callable[[FeatureNetwork, Diagram], EmbeddedPoints]


def optimise_sites(
    voronoi: RestrictedVoronoi,
    n_sites: int,
    features: FeatureNetwork,
    options: CVTOptions,
    *,
    feedback: DualFeedback | None = None,
    start: Sites | None = None,
    on_step: OnStep = ignore_steps,
    deadline: Deadline = NO_DEADLINE,
) -> Optimised:
    """Return optimised sites: a start, random or given, Lloyd's algorithm, then L-BFGS on the energy.

    Parameters
    ----------
    voronoi
        The diagram over the embedded surface.
    n_sites
        Number of sites S.
    features
        Boundary and creases of the surface. Sites whose cells reach them move onto them before L-BFGS and stay there.
    options
        How sites are optimised.
    feedback
        What the dual tells about sites; without it no site is relocated.
    start
        Positions (S, d) to begin with in place of random ones; they are not sampled anew.
    on_step
        Called after every iteration.
    deadline
        Asked before every iteration of L-BFGS.
    """
    stages = options.stages
    done, total = 0, options.lloyd_iterations + sum(limit for _, limit in stages)

    def report(iteration: int, energy: float) -> None:
        on_step(StepInfo(stage="cvt", iteration=done + iteration, total=total, energy=energy))

    if start is None:
        sites = ConstrainedSites.free(_start(voronoi, n_sites, options, report))
    else:
        sites = ConstrainedSites.free(lloyd(voronoi, start, options.lloyd_iterations, report))
    done = options.lloyd_iterations
    iterations = evaluations = 0
    for stage, (energy, limit) in enumerate(stages):
        if feedback is not None and options.relocate and stage > 0:
            errors = feedback.squared_errors(voronoi.diagram(sites.positions))
            if errors is not None:
                sites = relocate_to_missed_points(voronoi, sites, energy, errors)
        sites = _settle_on_features(voronoi, sites, features, energy, feedback, first=stage == 0)
        result = minimise(
            voronoi,
            sites.positions,
            energy,
            options=DescentOptions(max_iterations=limit),
            fixed=sites.fixed,
            on_iteration=report,
            deadline=deadline,
        )
        sites = sites.moved(result.sites)
        done += limit
        iterations += result.iterations
        evaluations += result.evaluations
        if result.status is Status.TIME_LIMIT:
            break
    return replace(result, iterations=iterations, evaluations=evaluations)


def _start(
    voronoi: RestrictedVoronoi, n_sites: int, options: CVTOptions, report: Callable[[int, float], None]
) -> Sites:
    """Return the sites (S, d) after Lloyd's algorithm, sampled anew after two thirds of its steps."""
    rng = np.random.default_rng(options.seed)
    first = options.lloyd_iterations - options.lloyd_iterations // 3
    embedded = voronoi.embedded
    sites = sample_surface(embedded.points, embedded.faces, embedded.sampling_weights, n_sites, rng)
    sites = lloyd(voronoi, sites, first, report)
    if options.resampling_energy is not None:
        sites = resample_by_energy(voronoi, sites, options.resampling_energy, rng)
    return lloyd(
        voronoi, sites, options.lloyd_iterations - first, lambda iteration, energy: report(first + iteration, energy)
    )


def _settle_on_features(
    voronoi: RestrictedVoronoi,
    sites: ConstrainedSites,
    features: FeatureNetwork,
    energy: Energy,
    feedback: DualFeedback | None,
    *,
    first: bool,
) -> ConstrainedSites:
    """Return the sites spread along the features, after rounds of relocation to creases that lack some."""
    if features.any:
        sites = spread_on_features(features, voronoi, sites)
    if feedback is not None and features.creases.n_polylines:
        for _ in range(_FIRST_CREASE_ROUNDS if first else 1):
            missing = feedback.missing_on_creases(features, voronoi.diagram(sites.positions))
            sites = relocate_to_creases(voronoi, sites, energy, missing)
            sites = snap_to_features(features, voronoi, sites)
    return sites

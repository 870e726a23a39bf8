"""How the sites are optimised: random start, Lloyd's algorithm, boundary and creases, L-BFGS, exchange of sites."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from anisomesh.cvt.features import Features
from anisomesh.cvt.optimise import Optimised, Status, lloyd, minimise
from anisomesh.cvt.relocation import bring_to_creases, exchange_sites
from anisomesh.cvt.sampling import resample_by_energy, sample_surface
from anisomesh.deadline import Stop, never
from anisomesh.mesh.surface import Surface
from anisomesh.options import OnStep, RemeshOptions, StepInfo
from anisomesh.voronoi.restricted import RestrictedVoronoi

EXCHANGE_AT = 0.6  # share of the iterations after which sites are exchanged
DENSITY_SHARPNESS = 1.5  # sharpness of the energy that sites are distributed by, over that of the optimisation
CREASE_ROUNDS = 3  # in which sites are brought to creases at the start; later in one


def optimise(
    voronoi: RestrictedVoronoi,
    n: int,
    surface: Surface,
    features: Features,
    scale: float,
    options: RemeshOptions,
    on_step: OnStep,
    stop: Stop = never,
) -> Optimised:
    """Return n optimised sites: a random start, Lloyd's algorithm, then L-BFGS on the normal-metric energy.

    With a normal metric the sites are drawn anew within Lloyd's algorithm, denser where the surface bends within a
    cell, and a few of them are exchanged within L-BFGS, for points that the dual would miss. Sites of cells at the
    boundary or a crease go onto it before L-BFGS and stay there, and others come to creases that lack some. ``stop`` is
    asked before every iteration of L-BFGS whether to end.
    """
    late = options.max_iterations // 2 if options.final_sharpness is not None else 0
    total = options.lloyd_iterations + options.max_iterations + late
    done = 0

    def report(iteration: int, energy: float) -> None:
        on_step(StepInfo(stage="cvt", iteration=done + iteration, total=total, energy=energy))

    rng = np.random.default_rng(options.seed)
    sites = sample_surface(voronoi.points, voronoi.faces, voronoi.facets.area, n, rng)
    first = options.lloyd_iterations - options.lloyd_iterations // 3
    sites = lloyd(voronoi, sites, first, report)
    done += first
    if options.sharpness > 1.0:
        sites = resample_by_energy(voronoi, sites, DENSITY_SHARPNESS * options.sharpness, rng)
    sites = lloyd(voronoi, sites, options.lloyd_iterations - first, report)
    done += options.lloyd_iterations - first
    schedule = [(options.sharpness, options.max_iterations)]
    if options.sharpness > 1.0:
        before = round(EXCHANGE_AT * options.max_iterations)
        schedule = [(options.sharpness, before), (options.sharpness, options.max_iterations - before)]
    if options.final_sharpness is not None:
        schedule.append((options.final_sharpness, late))
    iterations = evaluations = 0
    on_boundary, on_crease = np.zeros((2, n), dtype=bool)
    for stage, (sharpness, limit) in enumerate(schedule):
        if stage > 0 and options.sharpness > 1.0:
            sites = exchange_sites(voronoi, sites, surface, scale, sharpness, kept=on_boundary | on_crease)
        if features.any:
            sites, on_boundary, on_crease = features.spread(voronoi, sites, on_boundary, on_crease)
        rounds = CREASE_ROUNDS if stage == 0 else 1
        for _ in range(rounds if features.creases.curves.n_curves else 0):
            sites, on_crease = bring_to_creases(voronoi, sites, surface, features, sharpness, on_boundary, on_crease)
            sites, on_boundary, on_crease = features.draw(voronoi, sites, on_boundary, on_crease)
        fixed = on_boundary | on_crease
        result = minimise(
            voronoi, sites, sharpness=sharpness, max_iterations=limit, on_step=report, fixed=fixed, stop=stop
        )
        sites = result.sites
        done += limit
        iterations += result.iterations
        evaluations += result.evaluations
        if result.status is Status.TIME_LIMIT:
            break
    return replace(result, iterations=iterations, evaluations=evaluations)

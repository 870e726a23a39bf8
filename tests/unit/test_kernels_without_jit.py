"""The kernels also run as plain Python, so that coverage can be measured, with the same result."""

import os
import subprocess
import sys

import numpy as np
import pytest

PROGRAM = """
import numpy as np
import pytest
from anisomesh._kernels import predicates, warmup
from anisomesh.mesh.embedded_surface import EmbeddedSurface
from anisomesh.voronoi.restricted import RestrictedVoronoi
from anisomesh.shapes import analytic as shapes
surface = shapes.box(n=1)
sites = np.concatenate([surface.points[:5], 0.5 * (surface.points[:3] + surface.points[3:6])])
sites = np.concatenate([sites, sites[:2] + 0.01])
voronoi = RestrictedVoronoi(EmbeddedSurface.in_space(surface), threads=1)
energy, diagram = voronoi.integrate(sites, 7.0), voronoi.diagram(sites)
np.savez(
    {path!r}, gradient=energy.gradient, mass=energy.mass, label=diagram.label, site=diagram.site,
    barycentric=diagram.barycentric, jit=hasattr(predicates.sign_of_sum, "py_func"), cached=warmup.kernels_cached(),
)
"""


@pytest.mark.slow
def test_kernels_give_the_same_result_without_compilation(tmp_path):
    results = []
    for disabled in ("1", "0"):
        path = tmp_path / f"result{disabled}.npz"
        environment = {**os.environ, "NUMBA_DISABLE_JIT": disabled, "OMP_NUM_THREADS": "1"}
        subprocess.run(
            [sys.executable, "-W", "error::RuntimeWarning", "-c", PROGRAM.format(path=str(path))],
            env=environment,
            check=True,
            timeout=120,
        )
        results.append(np.load(path))
    plain, compiled = results
    assert (bool(plain["jit"]), bool(compiled["jit"])) == (False, True)
    assert plain["cached"]
    for name in ("label", "site", "barycentric"):
        np.testing.assert_array_equal(plain[name], compiled[name], err_msg=name)
    for name in ("gradient", "mass"):
        np.testing.assert_allclose(plain[name], compiled[name], rtol=0, atol=1e-14, err_msg=name)

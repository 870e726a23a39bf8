"""Importing loads nothing heavy; public names resolve to their definitions."""

import json
import subprocess
import sys

import pytest

import anisomesh

HEAVY = {"numba", "torch", "pyvista", "vtkmodules", "trimesh", "igl", "scipy", "meshio", "matplotlib"}


def modules_after(code: str) -> set[str]:
    """Return the top-level modules that a new interpreter has after running the code."""
    script = f"{code}\nimport json, sys\nprint('\\n' + json.dumps(sorted(sys.modules)))"
    process = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    return {name.partition(".")[0] for name in json.loads(process.stdout.splitlines()[-1])}


def test_importing_the_package_loads_nothing_heavy():
    assert not modules_after("import anisomesh") & (HEAVY | {"numpy"})


def test_help_loads_nothing_heavy():
    commands = ["", "remesh", "info", "demo", "figure", "figure result", "figure strip"]
    code = "from anisomesh.cli.main import main\n" + "".join(
        f"assert main({[*words.split(), '--help']!r}) == 0\n" for words in commands
    )
    assert not modules_after(code) & HEAVY


def test_public_names_resolve_to_what_the_modules_define():
    assert len(anisomesh.__all__) <= 47
    for name in anisomesh.__all__:
        value = getattr(anisomesh, name)
        assert name == "__version__" or value.__name__ == name
    assert set(anisomesh.__all__) <= set(dir(anisomesh))


def test_an_unknown_name_is_an_attribute_error():
    with pytest.raises(AttributeError, match="no attribute 'remsh'"):
        anisomesh.remsh  # noqa: B018


def test_the_version_is_that_of_the_distribution():
    from importlib.metadata import version

    assert anisomesh.__version__ == version("anisomesh")


def test_all_errors_are_anisomesh_errors():
    names = [name for name in anisomesh.__all__ if name.endswith("Error")]
    assert len(names) == 6
    assert all(issubclass(getattr(anisomesh, name), anisomesh.AnisomeshError) for name in names)

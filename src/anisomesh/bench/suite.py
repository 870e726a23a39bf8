"""Suites as TOML files, read strictly."""

from __future__ import annotations

from dataclasses import dataclass, field
from importlib import resources
from pathlib import Path
from typing import Any

from anisomesh.bench.disturb import CLEAN, check_disturbance
from anisomesh.bench.methods import METHODS
from anisomesh.errors import OptionError
from anisomesh.toml import check_keys, hint, parse_toml, read_toml

_SUITE_KEYS = {"description", "meshes", "shapes", "closed", "inputs", "ratios", "seeds", "samples", "methods"}
_METHOD_KEYS = {"name", "method", "options", "training"}


@dataclass(frozen=True, kw_only=True)
class SuiteMethod:
    """A remesher with its options, a ``[[methods]]`` table of a suite.

    Attributes
    ----------
    name
        Name in rows and tables, unique in the suite.
    method
        Key of :data:`anisomesh.bench.methods.METHODS`.
    options
        Keyword arguments of the remesher.
    training
        Training of the network that the method uses, with the keys of :mod:`anisomesh.learn.training.config`.
    """

    name: str
    method: str
    options: dict[str, Any] = field(default_factory=dict)
    training: dict[str, Any] | None = None


@dataclass(frozen=True, kw_only=True)
class Suite:
    """A benchmark: every method on every mesh and input, at every ratio, with every seed; one row per run.

    A suite is a TOML file with these keys; suites of the package are in ``anisomesh/bench/suites``.

    Attributes
    ----------
    name, description
        Name (of the file) and purpose.
    meshes
        Patterns of mesh files in the data folder, such as ``"test/*.ply"``.
    shapes
        Procedural shapes, ``"name:size"``, see :func:`anisomesh.bench.inputs.make_shape`.
    closed
        Skip meshes with a boundary.
    inputs
        Inputs of the methods: ``"clean"``, the repaired mesh; ``"noise SIZE"``, with normal noise of this standard
        deviation (in mean edge lengths) on every coordinate; ``"stretched"``, with triangles stretched in a random
        direction. Results are always compared with the clean mesh.
    ratios
        Vertices of the result per vertex of the clean mesh.
    seeds
        Seeds, for methods that use one.
    samples
        Random points on each surface for the measures of a result.
    methods
        The methods.
    """

    name: str
    description: str
    meshes: tuple[str, ...] = ()
    shapes: tuple[str, ...] = ()
    closed: bool = False
    inputs: tuple[str, ...] = (CLEAN,)
    ratios: tuple[float, ...] = (1.0,)
    seeds: tuple[int, ...] = (0,)
    samples: int = 100_000
    methods: tuple[SuiteMethod, ...]

    def __post_init__(self) -> None:
        if not min(self.ratios) > 0.0 or self.samples < 1:
            raise OptionError(f"{self.name}: ratios and samples must be positive")
        for name in self.inputs:
            check_disturbance(f"{self.name}: inputs", name)


def suite_names() -> list[str]:
    """Return the names of the suites of the package."""
    folder = resources.files("anisomesh.bench") / "suites"
    return sorted(entry.name.removesuffix(".toml") for entry in folder.iterdir() if entry.name.endswith(".toml"))


def load_suite(name: str) -> Suite:
    """Load a suite of the package by name, or a TOML file by path.

    Raises
    ------
    OptionError
        If there is no such suite, or the file has an error; the message names the place and the likely key.
    """
    if name in suite_names():
        text = (resources.files("anisomesh.bench") / "suites" / f"{name}.toml").read_text(encoding="utf-8")
    elif name.endswith(".toml") and (Path(name).is_file() or len(Path(name).parts) > 1):
        return parse_suite(Path(name).stem, read_toml(Path(name)))
    else:
        meant = hint(name, suite_names())
        raise OptionError(
            f"there is no suite {name!r}{meant}; expected one of {', '.join(suite_names())}, or a .toml file"
        )
    return parse_suite(Path(name).stem, parse_toml(name, text))


def parse_suite(name: str, table: dict[str, Any]) -> Suite:
    """Return the suite in a TOML table after checking every key.

    Raises
    ------
    OptionError
        If a key or method is unknown, missing, or has a value of the wrong kind.
    """
    check_keys(name, table, _SUITE_KEYS)
    methods = tuple(_method(name, entry) for entry in _list(name, table, "methods", dict))
    if not methods:
        raise OptionError(f"{name}: there is no method; add a [[methods]] table with name and method")
    if len({method.name for method in methods}) < len(methods):
        raise OptionError(f"{name}: two methods have the same name; give each its own")
    kinds = {"meshes": str, "shapes": str, "inputs": str, "ratios": int | float, "seeds": int}
    lists = {key: tuple(_list(name, table, key, kind)) for key, kind in kinds.items()}
    lists["ratios"] = tuple(map(float, lists["ratios"]))
    values: dict[str, Any] = {key: entries for key, entries in lists.items() if entries}  # empty ones keep the default
    values |= {key: table[key] for key in ("closed", "samples") if key in table}
    suite = Suite(name=name, description=str(table.get("description", "")), methods=methods, **values)
    if not suite.meshes and not suite.shapes:
        raise OptionError(f"{name}: there is no mesh; name files in meshes = [...] or shapes in shapes = [...]")
    return suite


def _method(suite: str, entry: dict[str, Any]) -> SuiteMethod:
    check_keys(f"{suite}: method {entry.get('name', '?')!r}", entry, _METHOD_KEYS)
    method = entry.get("method", "")
    if method not in METHODS:
        raise OptionError(
            f"{suite}: method {method!r} is unknown{hint(method, list(METHODS))}; expected one of {', '.join(METHODS)}"
        )
    options, training = entry.get("options", {}), entry.get("training")
    if not isinstance(options, dict):
        raise OptionError(f"{suite}: options = {options!r}; expected a table")
    if training is not None and not isinstance(training, dict):
        raise OptionError(f"{suite}: training = {training!r}; expected a table")
    return SuiteMethod(name=str(entry.get("name", method)), method=method, options=dict(options), training=training)


def _list(suite: str, table: dict[str, Any], key: str, kind: Any) -> list[Any]:
    values = table.get(key, [])
    if not isinstance(values, list) or not all(isinstance(value, kind) for value in values):
        raise OptionError(f"{suite}: {key} = {values!r}; expected a list")
    return values

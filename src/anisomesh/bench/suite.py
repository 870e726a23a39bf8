"""What a suite of runs is: a TOML file that names meshes, ratios, methods and seeds."""

from __future__ import annotations

from dataclasses import dataclass, field
from importlib import resources
from pathlib import Path
from typing import Any

from anisomesh.bench.disturb import CLEAN, check_disturbance
from anisomesh.bench.methods import METHODS
from anisomesh.errors import OptionError
from anisomesh.toml import check_keys, hint, parse_toml

_KEYS = {"description", "meshes", "shapes", "closed", "inputs", "ratios", "seeds", "samples", "methods"}
_METHOD_KEYS = {"name", "method", "options", "training"}


@dataclass(frozen=True, kw_only=True)
class Method:
    """A way to remesh.

    Attributes
    ----------
    name
        Of its row.
    method
        Which method, by its name in :data:`anisomesh.bench.methods.METHODS`.
    options
        What it takes.
    training
        How the network is trained whose weights the method uses, in the form of :mod:`anisomesh.learn.training.config`.
    """

    name: str
    method: str
    options: dict[str, Any] = field(default_factory=dict)
    training: dict[str, Any] | None = None


@dataclass(frozen=True, kw_only=True)
class Suite:
    """Runs of every method on every mesh, as it is or made worse, at every ratio with every seed.

    Attributes
    ----------
    name, description
        What the suite is called and what it shows.
    meshes
        Patterns of mesh files, relative to the data folder.
    shapes
        Meshes made by code, ``name:size``, see :func:`anisomesh.bench.inputs.make_shape`.
    closed
        Whether meshes with a boundary are left out.
    inputs
        What the methods are given: ``"clean"``, the mesh as it is; ``"noise SIZE"``, with noise of this deviation in
        mean edge lengths on every coordinate; ``"stretched"``, with other triangles, stretched in a random direction.
        Results are always compared with the clean mesh.
    ratios
        Vertices of the results per vertex of the prepared input.
    seeds
        Seeds of the methods that have one.
    samples
        Points on each surface that the results are measured with.
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
    methods: tuple[Method, ...]

    def __post_init__(self) -> None:
        if not min(self.ratios) > 0.0 or self.samples < 1:
            raise OptionError(f"{self.name}: ratios and samples must be positive")
        for name in self.inputs:
            check_disturbance(f"{self.name}: inputs", name)


def suite_names() -> list[str]:
    """Return the names of the suites that come with the package."""
    folder = resources.files("anisomesh.bench") / "suites"
    return sorted(entry.name.removesuffix(".toml") for entry in folder.iterdir() if entry.name.endswith(".toml"))


def load_suite(name: str) -> Suite:
    """Return a suite by the name of a shipped one or the path of a TOML file.

    Raises
    ------
    OptionError
        If there is no such suite, or the file has an error; the message says where, and what was meant.
    """
    if name in suite_names():
        text = (resources.files("anisomesh.bench") / "suites" / f"{name}.toml").read_text(encoding="utf-8")
    elif name.endswith(".toml") and Path(name).is_file():
        text = Path(name).read_text(encoding="utf-8")
    else:
        meant = hint(name, suite_names())
        raise OptionError(
            f"there is no suite {name!r}{meant}; expected one of {', '.join(suite_names())}, or a .toml file"
        )
    return parse_suite(Path(name).stem, parse_toml(name, text))


def parse_suite(name: str, table: dict[str, Any]) -> Suite:
    """Return the suite that a table of a TOML file describes, checked key by key.

    Raises
    ------
    OptionError
        If a key or method is unknown, missing, or has a value of the wrong kind.
    """
    check_keys(name, table, _KEYS)
    methods = tuple(_method(name, entry) for entry in _list(name, table, "methods", dict))
    if not methods:
        raise OptionError(f"{name}: there is no method; add a [[methods]] table with name and method")
    if len({method.name for method in methods}) < len(methods):
        raise OptionError(f"{name}: two methods have the same name; give each its own")
    suite = Suite(
        name=name,
        description=str(table.get("description", "")),
        meshes=tuple(_list(name, table, "meshes", str)),
        shapes=tuple(_list(name, table, "shapes", str)),
        closed=bool(table.get("closed", False)),
        inputs=tuple(_list(name, table, "inputs", str)) or (CLEAN,),
        ratios=tuple(float(ratio) for ratio in _list(name, table, "ratios", int | float)) or (1.0,),
        seeds=tuple(_list(name, table, "seeds", int)) or (0,),
        samples=int(table.get("samples", 100_000)),
        methods=methods,
    )
    if not suite.meshes and not suite.shapes:
        raise OptionError(f"{name}: there is no mesh; name files in meshes = [...] or shapes in shapes = [...]")
    return suite


def _method(suite: str, entry: dict[str, Any]) -> Method:
    check_keys(f"{suite}: method {entry.get('name', '?')!r}", entry, _METHOD_KEYS)
    method = entry.get("method", "")
    if method not in METHODS:
        raise OptionError(
            f"{suite}: method {method!r} is unknown{hint(method, list(METHODS))}; expected one of {', '.join(METHODS)}"
        )
    options, training = dict(entry.get("options", {})), entry.get("training")
    if training is not None and not isinstance(training, dict):
        raise OptionError(f"{suite}: training = {training!r}; expected a table")
    return Method(name=str(entry.get("name", method)), method=method, options=options, training=training)


def _list(suite: str, table: dict[str, Any], key: str, kind: Any) -> list[Any]:
    values = table.get(key, [])
    if not isinstance(values, list) or not all(isinstance(value, kind) for value in values):
        raise OptionError(f"{suite}: {key} = {values!r}; expected a list")
    return values

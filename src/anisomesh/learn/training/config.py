"""How a network is trained, from a TOML file."""

from __future__ import annotations

from dataclasses import MISSING, dataclass, field, fields, replace
from pathlib import Path
from typing import Any

from anisomesh.errors import OptionError
from anisomesh.learn.inference.pretrained import configuration_path, configurations, shipped_weights
from anisomesh.learn.models.paper import PaperOptions
from anisomesh.learn.models.stretch import NetworkOptions
from anisomesh.learn.training.losses import LOSSES
from anisomesh.toml import check_keys, read_toml


@dataclass(frozen=True, kw_only=True)
class TrainingOptions:
    """A training run.

    Attributes
    ----------
    data, out
        Folder of the data set, and of what the run writes.
    start
        Weights to start from, a file or the name of a shipped network; random ones without.
    epochs
        Times that every training item is seen.
    batch
        Items whose gradients are averaged for one step.
    rate, weight_decay, clip
        Of AdamW: the largest learning rate, reached after ``warmup`` steps and falling to zero along a cosine, the
        decay of weights, and the norm that gradients are cut to.
    warmup
        Steps in which the rate rises.
    noise, noise_share
        Largest noise that is added to points, in mean edge lengths, and the share of items that get some.
    seed
        Of the weights, the order of the items and the noise.
    minutes
        Between checkpoints.
    device
        ``"auto"``: a GPU where there is one, else the CPU; or as torch names it.
    network
        Kind and sizes of the network; in a file the table ``[network]`` has the sizes of the default network, the table
        ``[paper]`` in its place those of the paper's.
    loss, laplacian, gauge, augment
        For the paper's network: ``"dot"``, ``"l2"`` or ``"cosine"``; the weight of the Laplacian loss; whether its
        target is ``"aligned"`` first or taken ``"raw"`` as in the paper; and whether items are mirrored and turned.
    """

    data: str
    out: str
    start: str = ""
    epochs: int = 30
    batch: int = 4
    rate: float = 2e-3
    weight_decay: float = 1e-2
    clip: float = 1.0
    warmup: int = 100
    noise: float = 0.5
    noise_share: float = 0.5
    seed: int = 0
    minutes: float = 5.0
    device: str = "auto"
    network: NetworkOptions | PaperOptions = field(default_factory=NetworkOptions)
    loss: str = "dot"
    laplacian: float = 0.1
    gauge: str = "aligned"
    augment: bool = True

    def __post_init__(self) -> None:
        for name, low in (("epochs", 1), ("batch", 1), ("warmup", 0), ("seed", 0)):
            if getattr(self, name) < low:
                raise OptionError(f"{name} = {getattr(self, name)}; expected at least {low}")
        for name, known in (("loss", LOSSES), ("gauge", ("aligned", "raw"))):
            if getattr(self, name) not in known:
                raise OptionError(f"{name} = {getattr(self, name)!r}; expected one of {', '.join(known)}")
        for name in ("rate", "clip", "minutes"):
            if not getattr(self, name) > 0.0:
                raise OptionError(f"{name} = {getattr(self, name)}; expected a positive number")
        if not (0.0 <= self.noise_share <= 1.0 and min(self.noise, self.weight_decay, self.laplacian) >= 0.0):
            raise OptionError(
                "noise, weight_decay and laplacian must not be negative, and noise_share be between 0 and 1"
            )


def load_training(path: str | Path) -> TrainingOptions:
    """Return the training run that a TOML file describes; its folders are relative to that of the file.

    The name of a training that comes with the package stands for its file, and folders are relative to the current one.

    Raises
    ------
    OptionError
        If the file cannot be read, or a key is unknown, missing, or has a value of the wrong kind.
    """
    path, folder = Path(path), Path(path).parent
    if str(path) in configurations():
        path, folder = configuration_path(str(path)), Path()
    options = parse_training(str(path), read_toml(path))
    start = options.start if options.start in ("", *shipped_weights()) else str(folder / options.start)
    return replace(options, data=str(folder / options.data), out=str(folder / options.out), start=start)


def parse_training(where: str, table: dict[str, Any]) -> TrainingOptions:
    """Return the training run that a table describes; ``where`` it is from is said in errors.

    Raises
    ------
    OptionError
        If a key is unknown, missing, or has a value of the wrong kind.
    """
    if "network" in table and "paper" in table:
        raise OptionError(f"{where}: give either [network] or [paper]")
    name, kind = ("paper", PaperOptions) if "paper" in table else ("network", NetworkOptions)
    rest = {key: value for key, value in table.items() if key != name}
    sizes = _values(f"{where}: [{name}]", kind, table.get(name, {}))
    return TrainingOptions(**_values(where, TrainingOptions, rest), network=kind(**sizes))


def _values(where: str, kind: type, table: Any) -> dict[str, Any]:
    """Return the values of a table, checked against the fields of a dataclass."""
    if not isinstance(table, dict):
        raise OptionError(f"{where}: expected a table")
    known = {entry.name: entry for entry in fields(kind) if entry.name != "network"}
    check_keys(where, table, known)
    for name, entry in known.items():
        if name not in table and entry.default is MISSING and entry.default_factory is MISSING:
            raise OptionError(f"{where}: {name} is missing")
        if name not in table:
            continue
        wanted: Any = {"int": int, "float": int | float, "str": str, "bool": bool}[str(entry.type)]
        if not isinstance(table[name], wanted) or isinstance(table[name], bool) != (wanted is bool):
            raise OptionError(f"{where}: {name} = {table[name]!r}; expected {entry.type}")
    return dict(table)

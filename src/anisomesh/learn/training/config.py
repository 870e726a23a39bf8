"""Options of a training run, and reading them from a TOML file."""

from __future__ import annotations

from dataclasses import MISSING, dataclass, field, fields, replace
from pathlib import Path
from typing import Any

from anisomesh.errors import OptionError
from anisomesh.learn.architecture import FilterOptions, NetworkOptions, PaperOptions
from anisomesh.learn.inference.pretrained import configuration_path, pretrained_configurations, pretrained_weights
from anisomesh.learn.training.losses import LAPLACIAN_SCALES, LOSSES
from anisomesh.toml import check_keys, read_toml

_TABLES: dict[str, Any] = {"network": NetworkOptions, "paper": PaperOptions, "filter": FilterOptions}
_CHOICES: dict[str, tuple[str, ...]] = {
    "schedule": ("cosine", "halving"),
    "loss": LOSSES,
    "laplacian_scale": LAPLACIAN_SCALES,
    "gauge": ("aligned", "raw"),
    "symmetries": ("one", "all"),
    "keep": ("best", "last"),
}


@dataclass(frozen=True, kw_only=True)
class TrainingOptions:
    """Options of a training run; the keys of a configuration file have the same names.

    Attributes
    ----------
    data, out
        Folders of the data set, and of the files that the run writes.
    start
        Initial weights: a file, or the name of a pretrained network; random if empty.
    epochs
        Number of passes over the training items.
    batch
        Items per optimisation step.
    rate, warmup, schedule
        Largest learning rate of AdamW, reached after ``warmup`` steps. It falls to zero along a ``"cosine"``, or by
        ``"halving"`` after each sixth of the steps, as in the paper.
    weight_decay, clip
        Weight decay of AdamW, and the norm that gradients are clipped to.
    noise, noise_share
        Largest standard deviation of noise on the points, in mean edge lengths, and the share of items with noise.
    keep
        Whether the weights that are written are of the epoch with the ``"best"`` validation or of the ``"last"``.
    seed
        Seed of the initial weights, the order of the items and the noise.
    minutes
        Time between checkpoints.
    device
        A torch device, or ``"auto"``: a GPU if there is one, else the CPU.
    network
        Sizes of the default network, of the paper's, or of the filter of normals; table ``[network]``, ``[paper]`` or
        ``[filter]`` of a file.
    loss
        For the paper's network: ``"dot"``, ``"l2"`` or ``"cosine"``.
    laplacian, laplacian_scale
        Weight of the Laplacian loss, and its scale: ``"paper"``, so that the weight is the paper's w_lap, or
        ``"relative"`` to the Laplacian of the target; see :func:`anisomesh.learn.training.losses.laplacian_unit`.
    gauge
        Whether the target of the Laplacian loss is first ``"aligned"`` to the prediction, or used ``"raw"`` as in the
        paper.
    augment, symmetries
        Whether items of the paper's network are mirrored and rotated by quarter turns, and whether an epoch has each
        item in ``"one"`` of the ten ways, at random, or in ``"all"``, as in the paper, with ten times the steps.
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
    schedule: str = "cosine"
    noise: float = 0.5
    noise_share: float = 0.5
    seed: int = 0
    keep: str = "best"
    minutes: float = 5.0
    device: str = "auto"
    network: NetworkOptions | PaperOptions | FilterOptions = field(default_factory=NetworkOptions)
    loss: str = "dot"
    laplacian: float = 0.1
    laplacian_scale: str = "paper"
    gauge: str = "aligned"
    augment: bool = True
    symmetries: str = "one"

    def __post_init__(self) -> None:
        for name, low in (("epochs", 1), ("batch", 1), ("warmup", 0), ("seed", 0)):
            if getattr(self, name) < low:
                raise OptionError(f"{name} = {getattr(self, name)}; expected at least {low}")
        for name, known in _CHOICES.items():
            if getattr(self, name) not in known:
                raise OptionError(f"{name} = {getattr(self, name)!r}; expected one of {', '.join(known)}")
        for name in ("rate", "clip", "minutes"):
            if not getattr(self, name) > 0.0:
                raise OptionError(f"{name} = {getattr(self, name)}; expected a positive number")
        if not (0.0 <= self.noise_share <= 1.0 and min(self.noise, self.weight_decay, self.laplacian) >= 0.0):
            raise OptionError(
                "noise, weight_decay and laplacian must not be negative, and noise_share must be between 0 and 1"
            )


def load_training(path: str | Path) -> TrainingOptions:
    """Return the options in a TOML file.

    Folders are relative to the folder of the file. The name of a configuration of the package can stand for its file;
    then folders are relative to the current folder.

    Raises
    ------
    OptionError
        If the file cannot be read, or a key is unknown, missing, or has a value of the wrong type.
    """
    path, folder = Path(path), Path(path).parent
    if str(path) in pretrained_configurations():
        path, folder = configuration_path(str(path)), Path()
    options = parse_training(str(path), read_toml(path))
    start = options.start if options.start in ("", *pretrained_weights()) else str(folder / options.start)
    return replace(options, data=str(folder / options.data), out=str(folder / options.out), start=start)


def parse_training(where: str, table: dict[str, Any]) -> TrainingOptions:
    """Return the options in a TOML table; ``where`` names its origin in errors.

    Raises
    ------
    OptionError
        If a key is unknown, missing, or has a value of the wrong type.
    """
    given = [name for name in _TABLES if name in table]
    if len(given) > 1:
        raise OptionError(f"{where}: give only one of [{'], ['.join(given)}]")
    name = given[0] if given else "network"
    options_class = _TABLES[name]
    rest = {key: value for key, value in table.items() if key != name}
    sizes = _checked_values(f"{where}: [{name}]", options_class, table.get(name, {}))
    return TrainingOptions(**_checked_values(where, TrainingOptions, rest), network=options_class(**sizes))


def _checked_values(where: str, options_class: type, table: Any) -> dict[str, Any]:
    """Return the values of a table after a check of their names and types against the fields of a dataclass."""
    if not isinstance(table, dict):
        raise OptionError(f"{where}: expected a table")
    known = {entry.name: entry for entry in fields(options_class) if entry.name != "network"}
    check_keys(where, table, known)
    for name, entry in known.items():
        if name not in table and entry.default is MISSING and entry.default_factory is MISSING:
            raise OptionError(f"{where}: {name} is missing")
        if name not in table:
            continue
        expected: Any = {"int": int, "float": int | float, "str": str, "bool": bool}[str(entry.type)]
        if not isinstance(table[name], expected) or isinstance(table[name], bool) != (expected is bool):
            raise OptionError(f"{where}: {name} = {table[name]!r}; expected {entry.type}")
    return dict(table)

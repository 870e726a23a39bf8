"""What is left out of a file, for one warning."""

from __future__ import annotations

from anisomesh.attributes.model import Mesh

OF_FEATURES, OF_FIXED_POINTS = "regions of feature edges", "regions of fixed points"
"""What a warning calls divisions of features and of fixed points."""

EMPTY_REGIONS = "names of regions with nothing in them,"
"""What a warning calls names of labels that no face, edge or point has."""

TOO_LARGE = "whose integers are too large for float64"
"""Why integers of 64 bits are left out."""


class Losses:
    """Collects what a format cannot hold, for one warning."""

    def __init__(self) -> None:
        self._names: dict[str, list[str]] = {}
        self._reasons: dict[tuple[str, str], str] = {}
        self._others: list[str] = []
        self._changed: list[str] = []
        self._renamed: list[tuple[str, str]] = []

    def add(self, what: str, *names: str) -> None:
        """Add data of a kind, such as point data, with these names."""
        if names:
            self._names.setdefault(what, []).extend(name for name in names if name not in self._names.get(what, []))

    def because(self, what: str, name: str, reason: str) -> None:
        """Add data of a kind with the reason why these values are not held."""
        self.add(what, name)
        self._reasons[what, name] = reason

    def say(self, what: str) -> None:
        """Add something else."""
        self._others.append(what)

    def changed(self, name: str) -> None:
        """Add a name that is written with other characters."""
        self._changed.append(name)

    def renamed(self, name: str, text: str) -> None:
        """Add a name that another region has too, and the text that is written for it."""
        self._renamed.append((name, text))

    def features(self, mesh: Mesh) -> None:
        """Add the features and fixed points of a mesh, and their divisions."""
        if len(mesh.features):
            self.say(f"{len(mesh.features)} feature edge(s)")
        if len(mesh.fixed_points):
            self.say(f"{len(mesh.fixed_points)} fixed point(s)")
        self.fixed_faces(mesh)
        self.divisions_of_features(mesh)

    def fixed_faces(self, mesh: Mesh) -> None:
        """Add the fixed faces of a mesh."""
        if len(mesh.fixed_faces):
            self.say(f"{len(mesh.fixed_faces)} fixed face(s)")

    def divisions_of_features(self, mesh: Mesh) -> None:
        """Add the divisions of the features and fixed points of a mesh."""
        self.add(OF_FEATURES, *mesh.feature_regions)
        self.add(OF_FIXED_POINTS, *mesh.fixed_point_regions)

    def names_of_regions(self, mesh: Mesh, *divisions: str) -> None:
        """Add the names of the regions of divisions that have names."""
        self.add("names of regions", *(name for name in divisions if mesh.regions[name].names))

    def text(self) -> str:
        """Return everything in one line, empty if nothing is left out."""
        parts = []
        for what, names in self._names.items():
            parts += [f"{what} without a name"] if "" in names and not what.startswith("names of ") else []
            plain = [repr(name) for name in names if name and (what, name) not in self._reasons]
            parts += [f"{what} {', '.join(plain)}"] if plain else []
            parts += [f"{what} {name!r}, {why}" for name in names if name and (why := self._reasons.get((what, name)))]
        if self._changed:
            parts.append(f"some characters of {len(self._changed)} name(s) such as {self._changed[0]!r}")
        if self._renamed:
            name, text = self._renamed[0]
            parts.append(f"equal names of {len(self._renamed)} region(s) such as {name!r}, which is {text!r} there")
        return "; ".join([*parts, *self._others])

"""Reading of numbers that a user passes, in a module that imports nothing heavy, for the command line."""

from __future__ import annotations

import math
from dataclasses import dataclass
from numbers import Integral, Real

from anisomesh.errors import OptionError

LARGEST_SIZE = 1e30
"""Bound of lengths of edges, and inverse of the smallest, so that metrics are far from overflow."""

_LARGEST_INTEGER = 2**63 - 1


@dataclass(frozen=True)
class Length:
    """A length in model units, or in per cent of the bounding-box diagonal of the mesh."""

    value: float
    relative: bool

    @classmethod
    def parse(cls, text: str, option: str) -> Length:
        """Return the length in a text such as ``0.2`` or ``0.1%``.

        Raises
        ------
        OptionError
            If the text is not a positive finite number, with or without a per cent sign.
        """
        found = cls._number(text, option)
        if not (math.isfinite(found.value) and found.value > 0):
            raise OptionError(f"{option} {text}: expected a positive finite length")
        return found

    @classmethod
    def tolerance(cls, text: str, option: str) -> Length:
        """Return the length up to which points are the same, which may be 0, as :meth:`parse`."""
        found = cls._number(text, option, ", or auto")
        if not (math.isfinite(found.value) and found.value >= 0):
            raise OptionError(f"{option} {text}: expected a finite length of at least 0, or auto")
        return found

    @classmethod
    def _number(cls, text: str, option: str, others: str = "") -> Length:
        try:
            return cls(float(text.removesuffix("%")), text.endswith("%"))
        except ValueError:
            expected = f"expected a length such as 0.2, or 0.1% of the diagonal{others}"
            raise OptionError(f"{option} {text}: {expected}") from None

    def on(self, diagonal: float) -> float:
        """Return the length for a mesh with this bounding-box diagonal, in model units."""
        return self.value / 100.0 * diagonal if self.relative else self.value


def real_number(name: str, value: object, error: type[Exception] = OptionError) -> float:
    """Return a value as a float; raise an error of the given type unless it is a real number."""
    if isinstance(value, bool) or not isinstance(value, Real):
        raise error(f"{name} = {value!r}; expected a number{_remedy(value)}")
    try:
        return float(value)
    except OverflowError:
        raise error(f"{name} is an integer of {len(str(value))} digits; expected a smaller number") from None


def whole_number(name: str, value: object, low: int) -> int:
    """Return a value as an int; raise OptionError unless it is an integer from ``low`` to 2^63 - 1."""
    if isinstance(value, bool) or not isinstance(value, Integral):
        raise OptionError(f"{name} = {value!r}; expected a whole number of at least {low}{_remedy(value)}")
    if not low <= int(value) <= _LARGEST_INTEGER:
        raise OptionError(
            f"{name} = {value}; expected a whole number of at least {low}, and at most {_LARGEST_INTEGER}"
        )
    return int(value)


def _remedy(value: object) -> str:
    try:
        return ", written without quotes" if isinstance(value, str) and math.isfinite(float(value)) else ""
    except ValueError:
        return ""

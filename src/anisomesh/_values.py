"""Reading of numbers that a user passes, in a module that imports nothing heavy, for the command line."""

from __future__ import annotations

from numbers import Integral, Real

from anisomesh.errors import OptionError

_LARGEST_INTEGER = 2**63 - 1


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
    return ", written without quotes" if isinstance(value, str) else ""

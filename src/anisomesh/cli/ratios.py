"""The option ``--ratios``, which takes all numbers after it."""

from __future__ import annotations

from typing import Any

import typer
from typer.core import TyperCommand

from anisomesh.cli.arguments import share


class RatiosCommand(TyperCommand):
    """A command with an option ``--ratios`` that takes all numbers after it."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Join the numbers after ``--ratios`` to one word, then parse as usual."""
        words = list(args)
        if "--ratios" in words:
            first = words.index("--ratios") + 1
            last = first
            while last < len(words) and _is_number(words[last]):
                last += 1
            if last > first:
                words[first:last] = [" ".join(words[first:last])]
        return super().parse_args(ctx, words)


def _is_number(word: str) -> bool:
    try:
        float(word.removesuffix("%"))
    except ValueError:
        return False
    return True


def shares(ratios: str) -> list[float]:
    """Return the shares in a text, separated by spaces or commas.

    Raises
    ------
    typer.BadParameter
        If there is none, or one is not a positive finite number, with or without a per cent sign.
    """
    words = ratios.replace(",", " ").split()
    if not words:
        raise typer.BadParameter("--ratios: expected at least one number")
    try:
        return [share(word) for word in words]
    except typer.BadParameter as error:
        raise typer.BadParameter(f"--ratios: {error}") from None

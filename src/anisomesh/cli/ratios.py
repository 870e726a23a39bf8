"""The option ``--ratios``, which takes all numbers after it."""

from __future__ import annotations

from typing import Any

import typer
from typer.core import TyperCommand

from anisomesh.cli.arguments import share


class RatiosCommand(TyperCommand):
    """A command with an option ``--ratios`` that takes all numbers after it."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Join the numbers after ``--ratios`` to one word, then parse as usual.

        The message about words too many says which option they follow.
        """
        words, first, last = list(args), 0, 0
        if "--ratios" in words:
            first = last = words.index("--ratios") + 1
            while last < len(words) and _is_number(words[last]):
                last += 1
            if last > first:
                words[first:last] = [" ".join(words[first:last])]
        allowed, ctx.allow_extra_args = ctx.allow_extra_args, True
        extra = super().parse_args(ctx, words)
        ctx.allow_extra_args = allowed
        if extra and not (allowed or ctx.resilient_parsing):
            _refuse(ctx, extra, args, number_expected=last > first and args[last : last + 1] == extra[:1])
        return extra


def _refuse(context: Any, extra: list[str], words: list[str], *, number_expected: bool) -> None:
    """Raise a usage error for words too many, with the option that the first of them follows."""
    if number_expected:
        try:
            shares(extra[0])
        except typer.BadParameter as error:
            raise typer.BadParameter(str(error), context) from None
    place = len(words) - 1 - words[::-1].index(extra[0])
    option = " ".join(words[max(place - 2, 0) : place])
    after = f" after {option}" if option.startswith("-") else ""
    context.fail(f"Got unexpected extra argument(s) ({' '.join(extra)}){after}")


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

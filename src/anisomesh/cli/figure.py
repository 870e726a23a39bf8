"""``anisomesh figure``: the group of the three kinds of figures."""

from __future__ import annotations

import typer

from anisomesh.cli import figure_many, figure_result

app = typer.Typer(add_completion=False)
app.command("result")(figure_result.command)
app.command("gallery")(figure_many.gallery)
app.command("strip", cls=figure_many.StripCommand)(figure_many.strip)


@app.callback(invoke_without_command=True)
def group(context: typer.Context) -> None:
    """Draw figures as PNG or PDF, without a display (extra: picture)."""
    if context.invoked_subcommand is None:
        typer.echo(context.get_help())
        raise typer.Exit(2)

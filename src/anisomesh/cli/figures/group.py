"""``anisomesh figure``: the group of the three kinds of figures."""

from __future__ import annotations

import typer

from anisomesh.cli.figures import many, result
from anisomesh.cli.log import logs
from anisomesh.cli.ratios import RatiosCommand

app = typer.Typer(add_completion=False)
app.command("result")(logs(result.command))
app.command("gallery")(logs(many.gallery))
app.command("strip", cls=RatiosCommand)(logs(many.strip))


@app.callback(invoke_without_command=True)
def group(context: typer.Context) -> None:
    """Draw figures as PNG or PDF, without a display (extra: picture)."""
    if context.invoked_subcommand is None:
        typer.echo(context.get_help())
        raise typer.Exit(2)

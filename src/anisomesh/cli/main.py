"""Entry point of the ``anisomesh`` command: subcommands, exit codes, errors in one line.

Exit codes: 0 done, 1 anisomesh refused or failed (one line on stderr), 2 wrong usage, 3 some jobs of a batch failed,
130 interrupted, 143 ended by SIGTERM (commands with workers).
"""

from __future__ import annotations

import os
import re
import sys
from typing import Annotated

import typer

from anisomesh.cli import batch, benchmark, dataset, demo, evaluate, train
from anisomesh.cli.ending import ENDED_BY_SIGTERM
from anisomesh.cli.figures import group as figure
from anisomesh.cli.info.command import command as info_command
from anisomesh.cli.log import logs
from anisomesh.cli.ratios import RatiosCommand
from anisomesh.cli.remeshing.command import command as remesh_command
from anisomesh.cli.spelling import as_options, in_one_line
from anisomesh.errors import AnisomeshError

# The base class of all usage errors; typer exports only this subclass.
_UsageError: type[Exception] = typer.BadParameter.__bases__[0]
_WITH_FILES_OF_OPTIONS = ("benchmark", "dataset", "train")  # commands that read options by their names in Python

app = typer.Typer(
    name="anisomesh",
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)
app.command("remesh", cls=RatiosCommand)(logs(remesh_command))
app.command("evaluate")(logs(evaluate.command))
app.add_typer(figure.app, name="figure")
app.command("info")(logs(info_command))
app.command("demo")(logs(demo.command))
app.command("batch", cls=RatiosCommand)(logs(batch.command))
app.command("benchmark")(logs(benchmark.command))
app.add_typer(dataset.app, name="dataset")
app.command("train")(logs(train.command))


def _print_version(wanted: bool) -> None:
    if wanted:
        from importlib.metadata import version

        typer.echo(f"anisomesh {version('anisomesh')}")
        raise typer.Exit


@app.callback(invoke_without_command=True)
def _main(
    context: typer.Context,
    version: Annotated[
        bool,
        typer.Option("--version", "-V", help="Print the version and exit.", callback=_print_version, is_eager=True),
    ] = False,
) -> None:
    """Remesh triangle meshes anisotropically, with as many vertices as you ask for."""
    if context.invoked_subcommand is None:
        typer.echo(context.get_help())
        raise typer.Exit(2)


def main(arguments: list[str]) -> int:
    """Run the command line and return its exit code.

    Parameters
    ----------
    arguments
        The arguments after the program's name.

    Returns
    -------
    int
        0 done, 1 failed with one line on stderr, 2 wrong usage, 3 some jobs of a batch failed, 130 interrupted.
    """
    try:
        status = app(args=arguments, prog_name="anisomesh", standalone_mode=False) or 0
        if sys.stdout is not None:  # it is None if the shell has closed it
            sys.stdout.flush()
    except _UsageError as error:
        return _fail(_usage_message(error), 2)
    except AnisomeshError as error:
        return _fail(str(error) if arguments[0] in _WITH_FILES_OF_OPTIONS else as_options(str(error)), 1)
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 1
    except OSError as error:
        return _fail(f"{error.filename or 'output'}: {error.strerror or error}", 1)
    except MemoryError:
        return _fail("out of memory; ask for fewer vertices or samples, or use a machine with more memory", 1)
    except (KeyboardInterrupt, typer.Abort):
        status = 130
    except SystemExit as ended:
        if ended.code == ENDED_BY_SIGTERM:
            print("anisomesh: ended by SIGTERM", file=sys.stderr)
        raise
    if status == 130:
        print("anisomesh: interrupted", file=sys.stderr)
    return int(status)


_WORDS_OF_TYPER = {  # what versions of it that use pydantic say, and we in place of it
    "Value error, ": "",
    r"Input should be a valid integer\b.*": "expected a whole number",
    r"Input should be a valid number\b.*": "expected a number",
    r"Input should be greater than or equal to (\S+)": r"expected at least \1",
    r"Input should be less than or equal to (\S+)": r"expected at most \1",
}


def _fail(message: str, status: int) -> int:
    print(f"anisomesh: error: {in_one_line(message)}", file=sys.stderr)
    return status


def _usage_message(error: Exception) -> str:
    context = getattr(error, "ctx", None)
    command = context.command_path if context else "anisomesh"
    message = error.format_message() if hasattr(error, "format_message") else str(error)
    for pattern, words in _WORDS_OF_TYPER.items():
        message = re.sub(pattern, words, message)
    return f"{message.rstrip('.')}; see '{command} --help'"

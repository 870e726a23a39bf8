"""Every option of a remesh is on the command line, or there is a reason why not."""

from dataclasses import fields
from pathlib import Path

import pytest
import typer

from anisomesh.cli.main import app
from anisomesh.options import RemeshOptions

PYTHON_ONLY = {
    "energy": "an object with functions",
    "size_field": "an array or a function",
}
OTHER_NAMES = {"weld_tolerance": "weld"}
COMMAND = typer.main.get_command(app).commands["remesh"]
PARAMETERS = {parameter.name: parameter for parameter in COMMAND.params}
OPTIONS_PAGE = Path(__file__).parents[2] / "docs/reference/options.md"
FIELDS = {field.name: field for field in fields(RemeshOptions)}


def test_every_field_has_an_option_of_its_name_or_a_reason():
    missing = {name for name in FIELDS if OTHER_NAMES.get(name, name) not in PARAMETERS}
    assert missing == set(PYTHON_ONLY)


@pytest.mark.parametrize("name", [name for name in FIELDS if name in PARAMETERS])
def test_the_command_has_the_defaults_of_python(name):
    assert PARAMETERS[name].default == FIELDS[name].default


def test_every_option_of_a_remesh_is_described():
    page = OPTIONS_PAGE.read_text(encoding="utf-8")
    assert all(f"`{name}" in page for name in FIELDS)
    for name in FIELDS.keys() - PYTHON_ONLY.keys():
        names = PARAMETERS[OTHER_NAMES.get(name, name)]
        assert any(f"`{option}`" in page for option in [*names.opts, *names.secondary_opts]), name
    for name in PYTHON_ONLY:
        row = next(line for line in page.splitlines() if line.startswith("|") and f"`{name}`" in line)
        assert "Python only" in row

"""Every option of a remesh is on the command line, or there is a reason why not."""

from dataclasses import fields
from pathlib import Path

import pytest
import typer

from anisomesh.cli.main import app
from anisomesh.cli.spelling import _SPELLINGS, as_options
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


def test_messages_spell_options_that_there_are():
    options = {option for parameter in COMMAND.params for option in parameter.opts}
    assert {spelling.split()[-1] for spelling in _SPELLINGS.values()} <= options


@pytest.mark.parametrize(
    ("message", "expected"),
    [
        ("keep_points has 999; expected 0 to 127", "--keep-points has 999; expected 0 to 127"),
        ("weld_tolerance is 1000; expected", "--weld is 1000; expected"),
        ("give one of n_vertices, max_error and edge_length", "give one of --vertices, --max-error and --edge-length"),
        (
            "a density and an edge_length or size_field both say",
            "a density and an --edge-length or size of --metric-file both",
        ),
        ("with max_error only the distance counts", "with --max-error only the distance counts"),
        ("lock = 'a' is not a region; lock = it", "--lock = 'a' is not a region; lock = it"),
        ("density[0] = -1", "--density[0] = -1"),
        ("device 'cuda' cannot be used", "--device 'cuda' cannot be used"),
        ("in.obj: seed = 5", "in.obj: --seed = 5"),
        ("features of the input have moved", "features of the input have moved"),
        (
            "out/max_error.ply: no field 'min_size' and \"max_size\"",
            "out/max_error.ply: no field 'min_size' and \"max_size\"",
        ),
        ("max_error.ply: cannot be read", "max_error.ply: cannot be read"),
        ("it takes n_vertices.", "it takes --vertices."),
    ],
)
def test_options_in_messages_are_spelled_as_on_the_command_line(message, expected):
    assert as_options(message).startswith(expected)

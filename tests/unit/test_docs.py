"""The documentation names code, tests, files and options that exist."""

import importlib
import re
import textwrap
from pathlib import Path

import pytest
import typer

import anisomesh
from anisomesh.cli.main import app

ROOT = Path(__file__).parents[2]
PAGES = [*sorted((ROOT / "docs").rglob("*.md")), ROOT / "README.md", ROOT / "CONTRIBUTING.md"]
OTHER_PROGRAMS = ("pip", "python", "make", "git", "torchrun", "tensorboard", "source", "cd", "export", ".venv")
PACKAGES = {path.parent.name for path in (ROOT / "src/anisomesh").glob("*/__init__.py")}


def fences(text, language):
    return [textwrap.dedent(code) for code in re.findall(rf"^ *```{language}[^\n]*\n(.*?)^ *```", text, re.M | re.S)]


def options_of(command):
    own = {option for parameter in command.params for option in [*parameter.opts, *parameter.secondary_opts]}
    return own.union(*(options_of(inner) for inner in getattr(command, "commands", {}).values()))


def resolve(name):
    parts = name.split(".")
    for n in range(len(parts), 0, -1):
        try:
            found = importlib.import_module(".".join(["anisomesh", *parts[:n]]))
        except ModuleNotFoundError:
            continue
        for part in parts[n:]:
            found = getattr(found, part)
        return found
    raise ModuleNotFoundError(name)


@pytest.mark.parametrize("page", PAGES, ids=lambda path: path.name)
def test_python_in_pages_is_valid(page):
    for code in fences(page.read_text(encoding="utf-8"), "python"):
        compile(code, str(page), "exec")
        for name in re.findall(r"\banisomesh\.(\w+)", code):
            assert name in anisomesh.__all__ or name in PACKAGES, name


@pytest.mark.parametrize("page", PAGES, ids=lambda path: path.name)
def test_commands_in_pages_have_their_options(page):
    commands = typer.main.get_command(app)
    known = options_of(commands) | {"--help", "-h"}
    for line in "\n".join(fences(page.read_text(encoding="utf-8"), "sh")).replace("\\\n", " ").splitlines():
        words = line.split("#")[0].split()
        if "anisomesh" not in words[:1]:
            assert not words or words[0].startswith((*OTHER_PROGRAMS, "ANISOMESH_DATA")), line
            continue
        assert words[1] in commands.commands or words[1].startswith("--"), line
        assert {word for word in words if re.fullmatch(r"--?[a-z][a-z-]*", word)} <= known, line


@pytest.mark.parametrize("page", PAGES, ids=lambda path: path.name)
def test_options_in_text_exist(page):
    known = options_of(typer.main.get_command(app))
    elsewhere = {"--constraint", "--editable", "--extra", "--nproc-per-node", "--strict"}
    named = set(re.findall(r"`(--[a-z][a-z-]+)", page.read_text(encoding="utf-8")))
    assert named - elsewhere <= known


@pytest.mark.parametrize("page", ["paper.md", "architecture.md"])
def test_code_that_pages_name_exists(page):
    text = (ROOT / "docs" / page).read_text(encoding="utf-8")
    names = [name for name in re.findall(r"`([\w.]+)`", text) if name.split(".")[0] in PACKAGES and "." in name]
    for name in names:
        if name.endswith(".py"):
            continue
        assert resolve(name) is not None
    for path in re.findall(r"`([\w/]+/[\w]*(?:\.py)?)`", text):
        assert any((folder / path).exists() for folder in (ROOT / "src/anisomesh", ROOT / "tests", ROOT)), path


def test_the_readme_works_on_the_package_index():
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    assert all(target.startswith("https://") for target in re.findall(r"\]\(([^)]+)\)", text))
    images = re.findall(r"main/(docs/images/[\w.]+)", text)
    assert images
    assert all((ROOT / image).is_file() for image in images)


def test_the_api_page_lists_every_public_name():
    page = (ROOT / "docs/reference/api/index.md").read_text(encoding="utf-8")
    listed = " ".join(fences(page, "names")).split()
    assert sorted(listed) == sorted(name for name in anisomesh.__all__ if not name.startswith("_"))

"""Hooks of the documentation build: examples run, the command line and the API listed, formulas set as MathML."""

from __future__ import annotations

import hashlib
import logging
import os
import re
import subprocess
import sys
import tempfile
import tomllib
from pathlib import Path
from typing import Any

import latex2mathml.converter
from mkdocs.exceptions import PluginError
from mkdocs.structure.files import File

ROOT = Path(__file__).parents[1]
SOURCE = ROOT / "src" / "anisomesh"
CACHE = ROOT / ".cache" / "examples"
NOT_DOCUMENTED = ("_kernels", "cli")
EXAMPLE = re.compile(r"^```example\n(?P<name>\S+)\n```$", re.MULTILINE)
NAMES = re.compile(r"^```names\n(?P<names>[\w\s]+)\n```$", re.MULTILINE)
INLINE_MATH = re.compile(r'<span class="arithmatex">\\\((.*?)\\\)</span>', re.DOTALL)
BLOCK_MATH = re.compile(r'<div class="arithmatex">\s*\\\[(.*?)\\\]\s*</div>', re.DOTALL)
ROLE = re.compile(r":(?:class|func|meth|attr|data|mod):<code>(~?)([\w.]+)</code>")
BAR = re.compile(r"<mo[^>]*>(?=(?:&#x0007C;|\|)<)")
ENTITIES = {"&lt;": "<", "&gt;": ">", "&amp;": "&"}

log = logging.getLogger("mkdocs.plugins.anisomesh")


def on_files(files: Any, config: Any) -> Any:
    """Add the pictures of the examples, the pages of the API and of the command line."""
    for name in sorted({name for file in files.documentation_pages() for name in EXAMPLE.findall(file.content_string)}):
        for picture in sorted(run_example(name).glob("*.png")):
            uri = f"generated/{Path(name).stem}/{picture.name}"
            files.append(File.generated(config, uri, content=picture.read_bytes()))
    for package in packages():
        uri = f"reference/api/{package}.md"
        files.append(File.generated(config, uri, content=api_page(package)))
    files.append(File.generated(config, "reference/command-line.md", content=command_line_page()))
    return files


def on_page_markdown(markdown: str, page: Any, config: Any, files: Any) -> str:
    """Put the source, the output and the pictures of an example where a page asks for it."""
    if "{{ layers }}" in markdown:
        markdown = markdown.replace("{{ layers }}", layers())
    if NAMES.search(markdown):
        check_public_names({name for found in NAMES.findall(markdown) for name in found.split()})
        markdown = NAMES.sub(lambda match: "\n\n".join(map(public_name, match["names"].split())), markdown)
    up = "../" * page.file.src_uri.count("/")
    return EXAMPLE.sub(lambda match: shown(match["name"], up), markdown)


def on_page_content(html: str, page: Any, config: Any, files: Any) -> str:
    """Replace formulas by MathML and Sphinx roles in docstrings by links."""
    html = BLOCK_MATH.sub(lambda match: mathml(match[1], "block"), html)
    html = INLINE_MATH.sub(lambda match: mathml(match[1], "inline"), html)
    return ROLE.sub(link, html)


def mathml(formula: str, display: str) -> str:
    """Return a LaTeX formula, as it stands in HTML, as MathML, which browsers show without a script or a font."""
    for entity, character in ENTITIES.items():
        formula = formula.replace(entity, character)
    converted = latex2mathml.converter.convert(formula, display=display)
    converted = BAR.sub(r'<mo stretchy="false" lspace="0" rspace="0">', converted)
    return f'<div class="formula">{converted}</div>' if display == "block" else converted


def link(match: re.Match[str]) -> str:
    """Return a link to the object of a Sphinx role, if its name is a full one."""
    short, name = match.groups()
    text = name.rpartition(".")[2] if short else name
    if "." not in name:
        return f"<code>{text}</code>"
    return f'<autoref identifier="{name}" optional><code>{text}</code></autoref>'


def run_example(name: str) -> Path:
    """Run a program of examples/ in an empty folder; return the folder with its output and the files it wrote.

    The result is kept until the program or the package changes.
    """
    script = ROOT / "examples" / name
    digest = hashlib.sha256(script.read_bytes())
    for path in sorted(SOURCE.rglob("*.py")):
        digest.update(path.read_bytes())
    folder = CACHE / f"{script.stem}-{digest.hexdigest()[:16]}"
    if folder.is_dir():
        return folder
    log.info("Running examples/%s", name)
    CACHE.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=CACHE) as temporary:
        work = Path(temporary) / "work"
        work.mkdir()
        environment = {key: value for key, value in os.environ.items() if key != "DISPLAY"}
        process = subprocess.run(
            [sys.executable, script], cwd=work, env=environment, capture_output=True, text=True, check=False
        )
        if process.returncode:
            raise PluginError(f"examples/{name} failed:\n{process.stderr}")
        (work / "output.txt").write_text(process.stdout, encoding="utf-8")
        work.rename(folder)
    return folder


def shown(name: str, up: str) -> str:
    """Return an example as Markdown: source, what it printed, pictures that it drew."""
    folder = run_example(name)
    stem = Path(name).stem
    source = (ROOT / "examples" / name).read_text(encoding="utf-8").rstrip()
    parts = [f'```python title="examples/{name}"\n{source}\n```']
    output = (folder / "output.txt").read_text(encoding="utf-8").rstrip()
    if output:
        parts.append(f'```text title="Output"\n{output}\n```')
    parts += [
        f"![Picture drawn by examples/{name}]({up}generated/{stem}/{p.name})" for p in sorted(folder.glob("*.png"))
    ]
    return "\n\n".join(parts)


def layers() -> str:
    """Return the import layers, highest first, as pyproject.toml lists them."""
    with (ROOT / "pyproject.toml").open("rb") as file:
        contract = tomllib.load(file)["tool"]["importlinter"]["contracts"][0]
    return "```text\n" + "\n".join(contract["layers"]) + "\n```"


def check_public_names(documented: set[str]) -> None:
    """Refuse a page of public names that has others than ``import anisomesh`` offers."""
    import anisomesh

    public = {name for name in anisomesh.__all__ if not name.startswith("_")}
    if documented != public:
        raise PluginError(f"docs/reference/api/index.md: missing or unknown: {', '.join(sorted(documented ^ public))}")


def public_name(name: str) -> str:
    """Return the documentation of a name that ``import anisomesh`` offers."""
    return (
        f"::: anisomesh.{name}\n    options: {{show_root_heading: true, show_root_toc_entry: true, heading_level: 3}}"
    )


def packages() -> list[str]:
    """Return the packages of anisomesh that have a page in the API reference."""
    found = sorted(path.parent.name for path in SOURCE.glob("*/__init__.py"))
    return [name for name in found if name not in NOT_DOCUMENTED]


def api_page(package: str) -> str:
    """Return the page of a package: all its modules, from their docstrings."""
    modules = sorted(path for path in (SOURCE / package).rglob("*.py") if path.stem not in ("__init__", "__main__"))
    parts = [f"# anisomesh.{package}", f"::: anisomesh.{package}\n    options:\n      members: false"]
    for path in modules:
        name = ".".join(path.relative_to(SOURCE.parent).with_suffix("").parts)
        parts.append(f"## {name.removeprefix('anisomesh.')}\n\n::: {name}")
    return "\n\n".join(parts) + "\n"


def command_line_page() -> str:
    """Return the reference of the command line, from the commands themselves."""
    import typer

    from anisomesh.cli.main import app

    parts = ["# Command line\n\nEvery command and option, as `--help` prints them."]
    root = typer.main.get_command(app)
    parts += _command_parts(root, "anisomesh", 2)
    return "\n\n".join(parts) + "\n"


def _command_parts(command: Any, name: str, level: int) -> list[str]:
    parts = [f"{'#' * level} {name}", (command.help or "").strip()]
    rows = []
    for parameter in command.params:
        if parameter.name == "help":
            continue
        text = (getattr(parameter, "help", None) or "").replace("|", "\\|").replace("\n", " ")
        default = parameter.default
        shown_default = f"`{default}`" if isinstance(default, str | int | float | Path) and default is not False else ""
        names = ", ".join(f"`{option}`" for option in [*parameter.opts, *parameter.secondary_opts])
        if parameter.param_type_name == "argument":
            names = f"`{parameter.metavar or parameter.name.upper()}`"
        rows.append(f"| {names} | {text} | {shown_default} |")
    if rows and not getattr(command, "commands", None):
        parts.append("\n".join(["| argument or option | meaning | default |", "|---|---|---|", *rows]))
    for key, inner in sorted(getattr(command, "commands", {}).items()):
        if not inner.hidden:
            parts += _command_parts(inner, f"{name} {key}", min(level + 1, 4))
    return parts

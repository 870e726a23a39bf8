"""The text and JSON that the commands print."""

import io
import json
import logging
import sys
from types import SimpleNamespace

import pytest

from anisomesh.cli import progress as display
from anisomesh.cli.log import log_on_stderr
from anisomesh.cli.report import as_json, counted, describe_validity, summary, table
from anisomesh.metric.names import METRIC_NAMES
from anisomesh.options import EMBEDDINGS

SOUND = {
    "closed": True,
    "boundary_loops": 0,
    "components": 1,
    "euler": 2,
    "euler_input": 2,
    "nonmanifold_edges": 0,
    "nonmanifold_vertices": 0,
    "oriented": True,
    "inverted": 0,
}


def step(stage, iteration, total=10, energy=None, message=""):
    return SimpleNamespace(stage=stage, iteration=iteration, total=total, energy=energy, message=message)


def test_a_name_with_line_breaks_stays_in_its_row():
    """Regression: a line break in the name of a node broke the table, and the lines of the log."""
    text = table([("regions", "node: 1 (a/b\r\nc\x1b[2J \u2028d = 0)"), ("unit", "metre")])
    assert text.splitlines() == ["  regions  node: 1 (a/b c [2J d = 0)", "  unit     metre"]


def test_a_message_of_the_log_is_one_line(capsys):
    with log_on_stderr(0):
        logging.getLogger("anisomesh.io").warning("left out %s", "a\nb")
    assert capsys.readouterr().err == "anisomesh: warning: left out a b\n"


def test_json_stays_strict_when_numbers_are_not_finite():
    text = as_json({"a": float("nan"), "b": [1.5, float("inf")], "c": {"d": (float("-inf"), "x", True)}})
    assert json.loads(text, parse_constant=pytest.fail) == {"a": None, "b": [1.5, None], "c": {"d": [None, "x", True]}}


@pytest.mark.parametrize(
    ("count", "words", "text"),
    [(1, ("face",), "1 face"), (0, ("face",), "0 faces"), (12345, ("vertex", "vertices"), "12,345 vertices")],
)
def test_counted(count, words, text):
    assert counted(count, *words) == text


def test_table_aligns_the_second_column():
    lines = table([("a", "1"), ("long", "2")]).splitlines()
    assert lines[0].index("1") == lines[1].index("2")


def test_a_sound_surface_has_no_defect_in_its_description():
    assert describe_validity(SOUND) == "closed, 1 component, Euler 2, manifold"


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"closed": False, "boundary_loops": 3}, "3 boundary loops"),
        ({"euler": 0}, "Euler 0 (input 2)"),
        ({"nonmanifold_edges": 1}, "1 non-manifold edge"),
        ({"nonmanifold_vertices": 2}, "2 non-manifold vertices"),
        ({"oriented": False}, "not consistently oriented"),
        ({"inverted": 4}, "4 inverted triangles"),
    ],
)
def test_every_defect_is_named(change, words):
    text = describe_validity(SOUND | change)
    assert words in text
    assert ("manifold" in text.split(", ")) == ("nonmanifold" not in "".join(change))


REPORT = {
    "vertices": 1200,
    "vertices_asked": 1000,
    "faces": 2400,
    "validity": SOUND,
    "stretch": {"mean": 2.0, "max": 9.0},
    "embedding": "hybrid",
    "status": "converged",
    "iterations": 50,
    "energy": None,
    "seconds": {"load": 0.1, "cvt": 1.0, "total": 1.2},
    "warnings": ["something odd"],
}


def test_summary_names_warnings_notes_and_files(tmp_path):
    text = summary(REPORT, [tmp_path / "out.ply"], ["2 points merged"])
    for words in (
        "1,200 (asked for 1,000)",
        "something odd",
        "2 points merged",
        str(tmp_path / "out.ply"),
        "load 0.10",
    ):
        assert words in text


def embedding_row(name, **options):
    """Return the row of the summary that says what the embedding was made of."""
    text = summary(REPORT | {"embedding": name, "options": options}, [], [])
    return next(line for line in text.splitlines() if line.startswith("  embedding"))


def test_the_summary_says_what_every_embedding_and_metric_is():
    metrics = {name: embedding_row("direct", metric=name) for name in METRIC_NAMES}
    assert len(set(metrics.values())) == len(metrics)
    assert [name for name, row in metrics.items() if "curvature" in row] == ["curvature", "approximation"]
    for name in set(EMBEDDINGS) - {"auto"}:
        assert f"  {name} (" in embedding_row(name, metric="curvature")
    file = {"metric": None, "metric_file": "a.sol"}
    assert embedding_row("direct", **file) == "  embedding  direct (metric of a.sol)"
    field = {"metric": None, "adapt_to": "solved.vtu:u"}
    assert embedding_row("SolutionMetric", **field).endswith("direct (metric of the field solved.vtu:u)")


def test_plain_progress_has_one_line_per_stage_and_then_waits(monkeypatch, capsys):
    clock = iter([0.0, 0.1, 0.2, 6.0, 6.1])
    monkeypatch.setattr(display.time, "monotonic", lambda: next(clock))
    with display.progress(quiet=False) as show:
        for stage, iteration in (("prepare", 0), ("cvt", 1), ("cvt", 2), ("cvt", 3), ("cvt", 4)):
            show(step(stage, iteration, energy=0.5))
    out, err = capsys.readouterr()
    assert out == ""
    assert [line.split("  ")[0] for line in err.splitlines()] == [
        "preparing the mesh",
        "moving the sites",
        "moving the sites",
    ]
    assert "3/10" in err
    assert "energy 0.5" in err


def test_live_progress_goes_to_a_terminal(monkeypatch):
    class Terminal(io.StringIO):
        def isatty(self):
            return True

    terminal = Terminal()
    monkeypatch.setattr("sys.stderr", terminal)
    monkeypatch.setenv("TERM", "xterm")
    with display.progress(quiet=False) as show:
        show(step("cvt", 5, energy=0.25))
        show.note("a remark [x]")
    assert "moving the sites" in terminal.getvalue()
    assert "a remark [x]" in terminal.getvalue()


def test_quiet_progress_says_nothing(capsys):
    with display.progress(quiet=True) as show:
        show(step("cvt", 1))
        show.note("a remark")
    assert capsys.readouterr() == ("", "")


@pytest.mark.parametrize("cached", [True, False])
def test_compilation_is_announced_only_when_it_is_going_to_happen(monkeypatch, capsys, cached):
    warmup = SimpleNamespace(kernels_cached=lambda work: cached or work == "remesh")
    monkeypatch.setitem(sys.modules, "anisomesh._kernels.warmup", warmup)
    with display.progress(quiet=False) as show:
        display.announce_compilation(show, "remesh", "network")
    assert ("compiling" in capsys.readouterr().err) == (not cached)

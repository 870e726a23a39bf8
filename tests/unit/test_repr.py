"""How results and evaluations show themselves in a shell and in a notebook."""

from dataclasses import replace
from html.parser import HTMLParser

import numpy as np
import pytest

import anisomesh
from anisomesh.attributes.model import Mesh, Regions
from anisomesh.mesh.html import html_table
from anisomesh.shapes.analytic import sphere

BALL = sphere(2)


@pytest.fixture(scope="module")
def result():
    return anisomesh.remesh(BALL, n_vertices=60, metric="uniform", max_iterations=3)


def cells(html):
    """Return the texts of the cells of a table, unescaped, after a check that its tags are balanced."""
    open_tags, texts = [], []

    class Parser(HTMLParser):
        def handle_starttag(self, tag, attributes):
            open_tags.append(tag)

        def handle_endtag(self, tag):
            assert open_tags.pop() == tag

        def handle_data(self, data):
            texts.append(data)

    Parser().feed(html)
    assert open_tags == []
    return texts


def test_a_result_is_one_short_line(result):
    text = repr(result)
    assert text.startswith("RemeshResult(60 vertices, 116 triangles, valid, ")
    assert text.endswith(" s)")
    assert len(text) < 100
    assert "\n" not in text


def test_a_result_with_faults_names_them(result):
    changed = replace(result.validity, inverted=3, flat=1, oriented=False, euler=0, components=2)
    faulty = replace(result, validity=changed, warnings=("<b>3 & more</b>",))
    assert all(words in repr(faulty) for words in ("3 inverted triangles", "1 flat triangle,", "not oriented"))
    assert "Euler characteristic 0 instead of 2" in repr(faulty)
    assert "components 2 instead of 1" in repr(faulty)
    assert "valid" not in repr(faulty).replace("invalid", "")
    assert "<b>3 & more</b>" in cells(faulty._repr_html_())
    assert "<b>" not in faulty._repr_html_()


def test_an_evaluation_is_one_line_and_a_table(result):
    evaluation = anisomesh.evaluate(BALL, result.surface, samples=500)
    assert repr(evaluation).startswith("Evaluation(vertices 60, triangles 116, validity valid, RMS distance ")
    assert len(repr(evaluation)) < 200
    shown = cells(evaluation._repr_html_())
    assert shown[shown.index("largest distance") + 1] == f"{evaluation.distance.hausdorff:.3g}"


def test_surfaces_and_meshes_are_tables():
    """Regression: they had none in notebooks."""
    assert cells(BALL._repr_html_()) == ["Surface", "points", "162", "faces", "320"]
    mesh = Mesh(
        surface=BALL,
        point_data={"a<b": np.zeros(162), "c": np.zeros(162)},
        features=[[0, 1]],
        regions={"side": Regions(np.zeros(320, dtype=int))},
    )
    rows = ["points", "162", "faces", "320", "point data", "a<b, c", "regions", "side", "features", "1"]
    assert cells(mesh._repr_html_()) == ["Mesh", *rows]


def test_tables_are_escaped():
    assert cells(html_table("a<b", [("x&y", '"<script>"')])) == ["a<b", "x&y", '"<script>"']
    assert "<script>" not in html_table("t", [("n", "<script>")])

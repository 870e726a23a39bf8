"""What the embedding ``"auto"`` stands for."""

import pytest

from anisomesh.metric.sources import Uniform
from anisomesh.options import RemeshOptions
from anisomesh.resolve import embedding_name, is_designed, with_embedding_chosen
from anisomesh.shapes.analytic import box, sphere


@pytest.fixture(params=[False, True], ids=["without torch", "with torch"])
def torch_there(request, monkeypatch):
    monkeypatch.setattr("anisomesh.resolve.torch_is_there", lambda: request.param)
    return request.param


def chosen(surface, **options):
    return embedding_name(with_embedding_chosen(RemeshOptions(**options), surface))


def test_the_metric_of_designed_parts_is_measured(torch_there):
    assert is_designed(box(n=3))
    assert not is_designed(sphere(2))
    assert chosen(box(n=3)) == "direct"
    assert chosen(sphere(2)) == ("hybrid" if torch_there else "direct")


def test_what_was_asked_for_is_done(torch_there):
    assert chosen(box(n=3), embedding="hybrid") == "hybrid"
    assert chosen(box(n=3), weights="default") == "hybrid"
    assert chosen(sphere(2), embedding="direct") == "direct"
    assert chosen(sphere(2), metric="approximation") == "direct"
    assert chosen(sphere(2), metric=Uniform()) == "direct"

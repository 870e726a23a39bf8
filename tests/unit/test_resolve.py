"""What the embedding ``"auto"`` stands for."""

from anisomesh.denoise.source import Filtered
from anisomesh.metric.sources import Uniform
from anisomesh.options import RemeshOptions
from anisomesh.resolve import embedding_name, is_designed, with_embedding_chosen
from anisomesh.shapes.analytic import box, sphere


def chosen(surface, **options):
    return embedding_name(with_embedding_chosen(RemeshOptions(**options), surface))


def test_the_metric_of_designed_parts_is_measured():
    assert is_designed(box(n=3))
    assert not is_designed(sphere(2))
    assert chosen(box(n=3)) == "direct"
    assert chosen(sphere(2)) == "hybrid"


def test_what_was_asked_for_is_done():
    assert chosen(box(n=3), embedding="hybrid") == "hybrid"
    assert chosen(box(n=3), weights="default") == "hybrid"
    assert chosen(sphere(2), embedding="direct") == "direct"
    assert chosen(sphere(2), metric="approximation") == "direct"
    assert chosen(sphere(2), metric=Uniform()) == "direct"
    assert chosen(sphere(2), embedding="filtered") == "filtered"
    assert chosen(sphere(2), metric=Filtered()) == "filtered"

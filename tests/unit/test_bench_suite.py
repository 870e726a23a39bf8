"""Suites: the suites of the package are consistent; errors in a file name the place and a correction."""

import pytest

from anisomesh.bench.inputs import inputs_of, make_shape
from anisomesh.bench.suite import load_suite, parse_suite, suite_names
from anisomesh.errors import OptionError
from anisomesh.learn.inference.pretrained import pretrained_networks
from anisomesh.options import RemeshOptions

LEARNING = ("ablation-loss", "ablation-laplacian")
TABLE = {"shapes": ["sphere:100"], "methods": [{"name": "ours", "method": "anisomesh"}]}


@pytest.mark.parametrize("name", suite_names())
def test_suites_of_the_package_load_and_their_shapes_and_options_exist(name):
    suite = load_suite(name)
    assert suite.name == name
    assert suite.description
    for shape in suite.shapes:
        if not shape.endswith("000"):
            assert make_shape(shape).n_points > 10
    for method in suite.methods:
        if method.method == "anisomesh":
            RemeshOptions(**method.options)


def test_all_suites_of_the_paper_are_there():
    plain = {"smoke", "table1", "rocker-fertility", "zeroshot", "torus", "timing", "noise", "neural", "networks"}
    assert set(suite_names()) >= plain | set(LEARNING)


def test_networks_named_by_suites_come_with_the_package():
    named = {
        method.options["weights"]
        for name in suite_names()
        for method in load_suite(name).methods
        if "weights" in method.options
    }
    assert named
    assert named <= set(pretrained_networks())


@pytest.mark.parametrize("name", LEARNING)
def test_networks_of_suites_can_be_trained(name):
    pytest.importorskip("torch")
    from anisomesh.learn.training.config import parse_training

    for method in load_suite(name).methods:
        assert method.options["embedding"] == "neural"
        parse_training(name, {"data": "items", "out": "out", **method.training})


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"ratio": [1.0]}, "did you mean 'ratios'"),
        ({"ratios": 1.0}, "expected a list"),
        ({"ratios": [0.0]}, "must be positive"),
        ({"inputs": ["noisy"]}, "expected 'clean', 'stretched', or 'noise' and a size"),
        ({"inputs": ["noise -1"]}, "expected 'clean'"),
        ({"inputs": ["noise nan"]}, "expected 'clean'"),
        ({"methods": []}, "no method"),
        ({"shapes": []}, "no mesh"),
        ({"methods": [{"name": "x", "method": "anisomeshh"}]}, "did you mean 'anisomesh'"),
        ({"methods": [{"name": "x", "method": "acvd", "option": {}}]}, "did you mean 'options'"),
        ({"methods": 2 * TABLE["methods"]}, "same name"),
        ({"methods": [{"name": "x", "method": "anisomesh", "training": "default"}]}, "expected a table"),
    ],
)
def test_errors_say_what_was_meant(change, message):
    with pytest.raises(OptionError, match=message):
        parse_suite("mine", {**TABLE, **change})


def test_unknown_and_malformed_files(tmp_path):
    with pytest.raises(OptionError, match="did you mean 'smoke'"):
        load_suite("smokee")
    (tmp_path / "bad.toml").write_text("ratios = [1.0")
    with pytest.raises(OptionError, match="not valid TOML"):
        load_suite(str(tmp_path / "bad.toml"))


def test_missing_meshes_are_named(tmp_path):
    suite = parse_suite("mine", {**TABLE, "meshes": ["test/*.ply"]})
    with pytest.raises(OptionError, match=r"needs the meshes test/\*\.ply; name their folder"):
        inputs_of(suite, None)
    with pytest.raises(OptionError, match="has none of them"):
        inputs_of(suite, tmp_path)


@pytest.mark.parametrize("spec", ["cube:100", "sphere", "sphere:x", "torus:1", "ring:-3", "ring:nan"])
def test_wrong_shapes_are_refused(spec):
    with pytest.raises(OptionError, match="expected one of"):
        make_shape(spec)


@pytest.mark.parametrize("spec", ["sphere:1000", "ring:2000", "part:3000"])
def test_shapes_have_about_the_requested_size(spec):
    wanted = float(spec.split(":")[1])
    assert 0.4 * wanted < make_shape(spec).n_points < 2.5 * wanted


@pytest.mark.parametrize("ratio", [2.0, 6.0, 11.0])
def test_a_torus_has_the_stretch_in_its_name(ratio):
    torus = make_shape(f"torus:{ratio:g}")
    outer = torus.points[:, 0].max()
    minor = torus.points[:, 2].max()
    assert outer / minor == pytest.approx(ratio**2, rel=0.05)
    assert 3_000 < torus.n_points < 9_000

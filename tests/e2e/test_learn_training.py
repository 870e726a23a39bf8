"""Training: the same losses after a stop and a resume, consistent files, invalid configurations."""

import itertools
import json
import os
import signal
import subprocess
import sys
import time
from functools import cache, partial
from pathlib import Path

import numpy as np
import pytest

torch = pytest.importorskip("torch")

from tensorboard.backend.event_processing.event_accumulator import EventAccumulator  # noqa: E402
from torch.distributed.launcher.api import LaunchConfig, elastic_launch  # noqa: E402

import anisomesh  # noqa: E402
from anisomesh.bench.suite import parse_suite  # noqa: E402
from anisomesh.bench.training import train_networks  # noqa: E402
from anisomesh.cli.main import main  # noqa: E402
from anisomesh.errors import OptionError  # noqa: E402
from anisomesh.features.detect import WEAK_ANGLE, sharp_edges  # noqa: E402
from anisomesh.learn.architecture import FilterOptions, NetworkOptions, PaperOptions  # noqa: E402
from anisomesh.learn.data.items import load_item  # noqa: E402
from anisomesh.learn.data.manifest import ItemFiles, files_of  # noqa: E402
from anisomesh.learn.inference.predict import predict  # noqa: E402
from anisomesh.learn.inference.pretrained import weights_path  # noqa: E402
from anisomesh.learn.models.checkpoint import load_state, load_weights, save_state  # noqa: E402
from anisomesh.learn.training.config import TrainingOptions, load_training  # noqa: E402
from anisomesh.learn.training.processes import TrainingProcess  # noqa: E402
from anisomesh.learn.training.run import (  # noqa: E402
    CHECKPOINT,
    EVENTS,
    METRICS,
    WEIGHTS,
    DivergedError,
    TrainingRun,
)
from anisomesh.learn.training.tasks import EmbeddingTask, StretchTask, task_of  # noqa: E402
from anisomesh.learn.training.train import train  # noqa: E402
from anisomesh.learn.weights_file import WeightsError  # noqa: E402
from anisomesh.mesh.geometry import unit_frame  # noqa: E402
from anisomesh.working.surface import working_surface  # noqa: E402
from conftest import CLI  # noqa: E402

PAPER = PaperOptions(channels=8, levels=2)
NETWORK = NetworkOptions(channels=16, scales=3, blocks=1, heads=2)


@pytest.fixture(scope="module")
def files(item_folder):
    return files_of(item_folder)


def options_with(folder, **changes):
    return TrainingOptions(
        **{"data": "", "out": str(folder), "epochs": 4, "batch": 2, "warmup": 2, "network": NETWORK} | changes
    )


options = options_with


@pytest.fixture(scope="module")
def uninterrupted(files, tmp_path_factory):
    """Return a function of a network: the rows and the folder of a run that was not stopped, made once."""

    @cache
    def run(network):
        folder = tmp_path_factory.mktemp("whole")
        return train(options_with(folder / "run", network=network), files), folder / "run"

    return run


def losses(rows):
    return [{name: value for name, value in row.items() if name != "seconds"} for row in rows]


def weights(folder):
    return load_weights(folder / WEIGHTS)[0].state_dict()


@pytest.mark.slow
def test_a_run_learns_and_writes_its_files(files, tmp_path):
    rows = train(options(tmp_path / "run", epochs=12, rate=1e-2), files)
    assert [row["epoch"] for row in rows] == list(range(1, 13))
    # an epoch is two steps with random noise, so a single one can be a spike
    assert np.median([row["loss"] for row in rows[-4:]]) < 0.8 * rows[0]["loss"]
    lines = (tmp_path / "run" / METRICS).read_text().splitlines()
    assert [json.loads(line) for line in lines] == rows
    events = EventAccumulator(str(tmp_path / "run" / EVENTS)).Reload()
    assert [(event.step, pytest.approx(event.value)) for event in events.Scalars("loss")] == [
        (row["epoch"], row["loss"]) for row in rows
    ]
    network, facts = load_weights(tmp_path / "run" / WEIGHTS)
    assert network.options == NETWORK
    assert facts["training"]["epochs"] == 12
    best = min(rows, key=lambda row: row["validation 0"] + row["validation 0.3"])
    assert facts["epoch"] == best["epoch"]


@pytest.mark.slow
def test_a_run_that_was_stopped_in_its_validation_goes_on(files, uninterrupted, tmp_path, monkeypatch):
    whole, _ = uninterrupted(NETWORK)
    example, seen = StretchTask.example, []

    def stopping(task, item, noise, rng, *, training, **given):
        seen.append(training)
        if not training and seen.count(False) == 8:
            os.kill(os.getpid(), signal.SIGTERM)
        return example(task, item, noise, rng, training=training, **given)

    monkeypatch.setattr(StretchTask, "example", stopping)
    with pytest.raises(KeyboardInterrupt):
        train(options(tmp_path / "cut"), files)
    assert seen.count(False) == 8  # the rest of the validation waits
    assert losses(train(options(tmp_path / "cut"), files, resume=True)) == losses(whole)
    assert seen.count(True) == 4 * len(files.training)  # no step was made twice


class PowerCutError(BaseException):
    """Ends a run at once, without the checkpoint that a signal leaves."""


@pytest.mark.slow
def test_a_run_of_the_paper_that_was_killed_goes_on_from_its_last_checkpoint(files, tmp_path, monkeypatch):
    """Batch norms, all symmetries and halved rates; killed in the middle of the second of three epochs."""
    paper = partial(
        options, network=PAPER, epochs=3, batch=6, schedule="halving", symmetries="all", warmup=0, gauge="raw"
    )
    whole = train(paper(tmp_path / "whole"), files)
    losses_of, calls = EmbeddingTask.training_losses, []
    steps = -(-10 * len(files.training) // 6)

    def cut(task, network, examples):
        calls.append(None)
        if len(calls) == steps + steps // 2:
            raise PowerCutError
        return losses_of(task, network, examples)

    monkeypatch.setattr(EmbeddingTask, "training_losses", cut)
    with pytest.raises(PowerCutError):
        train(paper(tmp_path / "cut"), files)
    assert losses(train(paper(tmp_path / "cut"), files, resume=True)) == losses(whole)
    assert len(calls) == 3 * steps + steps // 2  # half an epoch was done twice
    for name, value in weights(tmp_path / "whole").items():
        torch.testing.assert_close(weights(tmp_path / "cut")[name], value, rtol=0, atol=0)


@pytest.mark.slow
def test_weights_of_the_best_or_of_the_last_epoch_are_kept(files, tmp_path, monkeypatch):
    monkeypatch.setattr(TrainingRun, "validate", lambda run, interruption: {"validation 0": float(run.at.epoch)})
    for keep, epoch in (("best", 1), ("last", 3)):
        train(options(tmp_path / keep, epochs=3, keep=keep), files)
        assert load_weights(tmp_path / keep / WEIGHTS)[1]["epoch"] == epoch


@pytest.mark.parametrize(("epochs", "steps"), [(600, 3), (6, 4), (4, 10)])
def test_halved_rates_are_constant_for_a_sixth_of_the_run(epochs, steps, tmp_path):
    files = ItemFiles(training=[Path(str(k)) for k in range(2 * steps)], validation=[])
    given = options(tmp_path, epochs=epochs, schedule="halving", rate=0.01, warmup=0, network=PAPER)
    task = task_of(given)
    network = task.network()
    run = TrainingRun(given, task, files, network, torch.optim.AdamW(network.parameters()), TrainingProcess())
    rates = [run.rate(step) for step in range(epochs * steps)]
    values, counts = np.unique(rates, return_counts=True)
    np.testing.assert_allclose(values[::-1], 0.01 * 0.5 ** np.arange(6))
    assert np.ptp(counts) <= 1
    assert rates == sorted(rates, reverse=True)
    if epochs == 600:
        assert [run.rate(steps * epoch) for epoch in (0, 99, 100, 599)] == [0.01, 0.01, 0.005, 0.01 / 32]


@pytest.mark.slow
def test_a_loss_that_is_not_finite_ends_the_run_and_leaves_its_checkpoint(files, tmp_path):
    with pytest.raises(DivergedError, match="lower rate"):
        train(options(tmp_path / "run", rate=1e30, warmup=0), files)
    assert not (tmp_path / "run" / WEIGHTS).exists()


@pytest.mark.slow
def test_a_run_does_not_go_on_with_other_items_or_without_a_checkpoint(files, tmp_path):
    with pytest.raises(OptionError, match="without --resume"):
        train(options(tmp_path / "none"), files, resume=True)
    train(options(tmp_path / "run", epochs=1), files)
    others = (
        ItemFiles(training=files.training[::-1], validation=files.validation),
        ItemFiles(training=[*files.training, files.validation[0]], validation=files.validation[1:]),
    )
    for other in others:
        with pytest.raises(WeightsError, match="other items"):
            train(options(tmp_path / "run", epochs=1), other, resume=True)


@pytest.mark.slow
def test_a_run_goes_on_without_the_weights_that_it_started_from(files, tmp_path):
    train(options(tmp_path / "first", epochs=1), files)
    start = tmp_path / "first" / WEIGHTS
    train(options(tmp_path / "run", epochs=1, start=str(start)), files)
    start.unlink()
    train(options(tmp_path / "run", epochs=1, start="elsewhere", minutes=1.0), files, resume=True)


def test_moments_are_restored_to_their_parameters_where_some_have_none(tmp_path):
    def made():
        network = torch.nn.ModuleList(torch.nn.Linear(2, 2) for _ in range(3))
        return network, torch.optim.AdamW(network.parameters())

    network, optimiser = made()
    network[2](torch.ones(1, 2)).sum().backward()  # the others have no gradient
    optimiser.step()
    save_state(tmp_path / "state", network, optimiser, {})
    other, restored = made()
    load_state(tmp_path / "state", other, restored)
    wanted = optimiser.state_dict()["state"]
    assert restored.state_dict()["state"].keys() == wanted.keys() == {4, 5}
    for number, values in wanted.items():
        for name, value in values.items():
            torch.testing.assert_close(restored.state_dict()["state"][number][name], value)


@pytest.mark.parametrize(
    ("kind", "sizes"),
    [
        (NetworkOptions, {"scales": 0}),
        (NetworkOptions, {"channels": 0}),
        (NetworkOptions, {"heads": 6}),
        (PaperOptions, {"ratio": 1.5}),
        (PaperOptions, {"levels": -1}),
        (PaperOptions, {"channels": 0}),
        (PaperOptions, {"skip": "none"}),
        (PaperOptions, {"norm": "layer"}),
        (FilterOptions, {"rounds": 0}),
    ],
)
def test_invalid_network_sizes_are_refused(kind, sizes):
    with pytest.raises(OptionError, match=next(iter(sizes))):
        kind(**sizes)


@pytest.mark.slow
@pytest.mark.parametrize(("stop_after", "network"), [(1, NETWORK), (3, NETWORK), (2, PAPER)])
def test_a_run_that_was_stopped_goes_on_as_if_it_had_not_been(files, uninterrupted, tmp_path, stop_after, network):
    options = partial(options_with, network=network)
    whole, folder = uninterrupted(network)

    def stop(row):
        if row["epoch"] == stop_after:
            os.kill(os.getpid(), signal.SIGTERM)  # seen after the next step, in the middle of an epoch

    with pytest.raises(KeyboardInterrupt):
        train(options(tmp_path / "cut"), files, on_row=stop)
    seen = []
    rest = train(options(tmp_path / "cut"), files, resume=True, on_row=seen.append)
    assert losses(rest) == losses(whole)
    assert [row["epoch"] for row in seen] == list(range(stop_after + 1, 5))
    for name, value in weights(folder).items():
        torch.testing.assert_close(weights(tmp_path / "cut")[name], value, rtol=0, atol=0)


@pytest.mark.slow
def test_a_run_starts_from_weights_and_refuses_weights_of_another_network(files, tmp_path):
    first = train(options(tmp_path / "one", epochs=8, rate=1e-2), files)
    given = tmp_path / "one" / WEIGHTS
    more = train(options(tmp_path / "two", epochs=1, rate=1e-6, start=str(given)), files)
    best = min(first, key=lambda row: row["validation 0"] + row["validation 0.3"])
    assert more[0]["validation 0"] == pytest.approx(best["validation 0"], rel=1e-2)
    with pytest.raises(WeightsError, match="another kind or size"):
        train(options(tmp_path / "three", start="default"), files)


@pytest.mark.slow
def test_handlers_of_signals_are_as_before(files, tmp_path):
    before = signal.getsignal(signal.SIGTERM), signal.getsignal(signal.SIGINT)
    train(options(tmp_path / "run", epochs=1), files)
    assert (signal.getsignal(signal.SIGTERM), signal.getsignal(signal.SIGINT)) == before


@pytest.mark.slow
def test_a_run_is_not_overwritten_and_not_mixed_with_another(files, tmp_path):
    train(options(tmp_path / "run", epochs=1), files)
    with pytest.raises(OptionError, match="--resume"):
        train(options(tmp_path / "run", epochs=1), files)
    with pytest.raises(WeightsError, match="another rate"):
        train(options(tmp_path / "run", epochs=1, rate=1e-4), files, resume=True)
    fewer = ItemFiles(training=files.training[:2], validation=files.validation)
    with pytest.raises(WeightsError, match="other items"):
        train(options(tmp_path / "run", epochs=1), fewer, resume=True)
    with pytest.raises(OptionError, match="no items"):
        train(options(tmp_path / "none"), ItemFiles(training=[], validation=[]))
    path = tmp_path / "run" / CHECKPOINT
    path.write_bytes(path.read_bytes()[:1000])
    with pytest.raises(WeightsError, match="safetensors"):
        train(options(tmp_path / "run", epochs=1), files, resume=True)


@pytest.mark.parametrize("data", [b"", b"hello there", b"\xff" * 100, (10**9).to_bytes(8, "little") + b"{}"])
def test_invalid_weight_files_are_refused(tmp_path, data):
    (tmp_path / "a.safetensors").write_bytes(data)
    for path in (tmp_path / "a.safetensors", tmp_path / "none.safetensors"):
        with pytest.raises(WeightsError, match=r"\.safetensors: cannot be read"):
            load_weights(path)


CONFIG = (
    'data = "items"\nout = "run"\nepochs = 2\nbatch = 2\n[network]\nchannels = 16\nscales = 3\nblocks = 1\nheads = 2\n'
)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (CONFIG.replace("epochs", "epoch"), r"unknown key 'epoch' \(did you mean 'epochs'"),
        (CONFIG.replace("channels", "chanels"), r"network.*unknown key 'chanels' \(did you mean 'channels'"),
        (CONFIG.replace("epochs = 2", "epochs = 0"), "epochs = 0; expected at least 1"),
        (CONFIG.replace("epochs = 2", 'epochs = "two"'), "epochs = 'two'; expected int"),
        (CONFIG.replace('out = "run"', ""), "out is missing"),
        ("network = 3\n" + CONFIG.split("[network]")[0], "expected a table"),
        ("nonsense", "not valid TOML"),
        (CONFIG + "[paper]\nchannels = 8\n", r"only one of \[network\], \[paper\]"),
        (CONFIG.replace("epochs", 'loss = "l3"\nepochs'), "loss = 'l3'; expected one of dot, l2, cosine"),
        (CONFIG.replace("epochs", 'gauge = "round"\nepochs'), "gauge = 'round'; expected one of aligned, raw"),
        (CONFIG.replace("epochs", "augment = 1\nepochs"), "augment = 1; expected bool"),
        (CONFIG.replace("epochs", "loss = 1\nepochs"), "loss = 1; expected str"),
        (CONFIG.replace("epochs", 'schedule = "step"\nepochs'), "schedule = 'step'; expected one of cosine, halving"),
        (CONFIG.replace("epochs", 'symmetries = "ten"\nepochs'), "symmetries = 'ten'; expected one of one, all"),
        (CONFIG.replace("epochs", 'laplacian_scale = "own"\nepochs'), "laplacian_scale = 'own'; expected one of paper"),
    ],
)
def test_wrong_configurations_say_what_is_meant(tmp_path, text, words):
    (tmp_path / "a.toml").write_text(text)
    with pytest.raises(OptionError, match=words):
        load_training(tmp_path / "a.toml")
    with pytest.raises(OptionError, match="no such file; expected a TOML file"):
        load_training(tmp_path / "none.toml")


def test_folders_of_a_configuration_are_relative_to_its_file(tmp_path):
    (tmp_path / "a.toml").write_text(CONFIG)
    loaded = load_training(tmp_path / "a.toml")
    assert (loaded.data, loaded.out) == (str(tmp_path / "items"), str(tmp_path / "run"))
    assert loaded.network == NETWORK
    sizes = CONFIG.split("[network]")[0] + "[paper]\nchannels = 8\nlevels = 2\n"
    (tmp_path / "a.toml").write_text(sizes)
    assert load_training(tmp_path / "a.toml").network == PAPER


@pytest.mark.parametrize(
    ("name", "network", "data"), [("default-more", "default", "items-given"), ("paper", "paper", "items")]
)
def test_pretrained_networks_have_the_options_of_their_configurations(name, network, data):
    loaded = load_training(name)
    assert (loaded.data, loaded.out) == (data, name)  # relative to the current folder
    weights, facts = load_weights(weights_path(network))
    assert loaded.network == weights.options
    same = ("epochs", "batch", "rate", "noise", "noise_share", "seed", "loss", "laplacian", "gauge", "augment")
    assert {key: facts["training"][key] for key in same} == {key: getattr(loaded, key) for key in same}


def test_every_run_of_the_default_network_starts_from_the_one_before():
    runs = [load_training(name) for name in ("default", "default-further", "default-given", "default-more")]
    for before, after in itertools.pairwise(runs):
        assert after.network == before.network
        assert after.start == str(Path(before.out) / WEIGHTS)


@pytest.mark.slow
def test_the_command_trains_stops_and_resumes(files, tmp_path, run_cli):
    (tmp_path / "a.toml").write_text(
        CONFIG.replace('"items"', f'"{files.training[0].parent}"').replace("epochs = 2", "epochs = 12")
    )
    process = subprocess.Popen([*CLI, "train", "a.toml"], cwd=tmp_path, stderr=subprocess.DEVNULL)
    deadline = time.monotonic() + 240
    while not (tmp_path / "run" / METRICS).exists() and time.monotonic() < deadline:
        time.sleep(0.05)
    process.send_signal(signal.SIGTERM)
    assert process.wait(240) == 130
    before = len((tmp_path / "run" / METRICS).read_text().splitlines())
    assert 1 <= before < 12
    assert run_cli("train", "a.toml", cwd=tmp_path).returncode == 1
    done = run_cli("train", "a.toml", "--resume", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("12 epochs; wrote")
    assert f"epoch {before + 1}:" in done.stderr
    assert f"epoch {before}:" not in done.stderr


@pytest.mark.slow
def test_networks_of_a_suite_are_trained_in_stretches(item_folder, tmp_path):
    training = {"epochs": 2, "batch": 2, "noise_share": 0.0, "paper": {"channels": 8, "levels": 2}}
    methods = [
        {"name": f"w {weight}", "method": "anisomesh", "training": {**training, "laplacian": weight}}
        for weight in (0.1, 0.5)
    ]
    suite = parse_suite("tiny", {"shapes": ["sphere:100"], "methods": methods})
    whole = train_networks(suite, tmp_path / "whole", item_folder)
    told = []

    def stop(text):
        told.append(text)
        if len(told) in (1, 3):  # in the first network and, when that is done, in the second
            os.kill(os.getpid(), signal.SIGTERM)

    for _ in range(2):
        with pytest.raises(KeyboardInterrupt):
            train_networks(suite, tmp_path / "cut", item_folder, stop)
    found = train_networks(suite, tmp_path / "cut", item_folder, stop)
    assert [text.split(" of")[0] for text in told] == [
        f"w {weight}: epoch {n}" for weight in (0.1, 0.5) for n in (1, 2)
    ]
    for name, path in found.items():
        for mine, theirs in zip(*(load_weights(file)[0].parameters() for file in (path, whole[name])), strict=True):
            torch.testing.assert_close(mine, theirs, rtol=0, atol=0)


@pytest.mark.slow
def test_two_workers_train_as_one(files, tmp_path, monkeypatch, capfd):
    train(options(tmp_path / "one", epochs=2), files)
    text = CONFIG.replace('"items"', f'"{files.training[0].parent}"').replace("batch = 2", "batch = 2\nwarmup = 2")
    (tmp_path / "a.toml").write_text(text.replace('"run"', '"two"'))
    monkeypatch.chdir(tmp_path)
    launch = LaunchConfig(
        min_nodes=1,
        max_nodes=1,
        nproc_per_node=2,
        rdzv_backend="c10d",
        rdzv_endpoint="localhost:0",
        start_method="fork" if sys.platform == "linux" else "spawn",  # a new process imports torch for seconds
    )
    assert elastic_launch(launch, main)(["train", "a.toml"]) == {0: 0, 1: 0}
    one, two = (
        [json.loads(line) for line in (tmp_path / name / METRICS).read_text().splitlines()] for name in ("one", "two")
    )
    assert len(one) == len(two) == 2
    for mine, theirs in zip(one, two, strict=True):
        for name in ("loss", "validation 0", "validation 0.3"):
            assert theirs[name] == pytest.approx(mine[name], rel=1e-3)
    assert capfd.readouterr().err.count("epoch 2:") == 1


@pytest.mark.slow
def test_a_remesh_takes_the_metric_of_a_trained_network(files, tmp_path, run_cli):
    surface = load_item(files.validation[0]).surface
    train(options(tmp_path / "run", epochs=12, rate=1e-2), files)
    weights = tmp_path / "run" / WEIGHTS
    result = anisomesh.remesh(surface, n_vertices=150, embedding="neural", weights=weights, max_iterations=20)
    assert result.surface.n_points == 150
    unit = surface.with_points(unit_frame(surface.points).to_unit(surface.points))
    creases = sharp_edges(unit, WEAK_ANGLE)
    working = working_surface(unit, 150, creases=creases, tagged=np.zeros_like(creases))
    found = predict(working.surface, weights)
    np.testing.assert_allclose(result.working.points, found.points, atol=1e-6)
    stretch = np.sqrt(np.linalg.eigvalsh(found.tensors)[:, 2])
    assert stretch.mean() > 1.1
    assert result.embedding.stretch.target_mean == pytest.approx(stretch.mean(), rel=0.1)
    anisomesh.save(surface, tmp_path / "in.ply")
    words = ("remesh", tmp_path / "in.ply", "-o", tmp_path / "out.ply", "-n", 100, "--embedding", "neural")
    done = run_cli(*words, "--weights", weights)
    assert done.returncode == 0, done.stderr
    assert anisomesh.load(tmp_path / "out.ply").n_points == 100
    done = run_cli(*words, "--weights", tmp_path / "in.ply")
    assert done.returncode == 1
    assert "safetensors" in done.stderr.strip().splitlines()[-1]
    with pytest.raises(OptionError, match="and no other"):
        anisomesh.remesh(surface, n_vertices=150, embedding="neural", weights=weights, metric="uniform")


@pytest.mark.slow
def test_networks_run_without_torch_and_the_error_of_a_gpu_names_the_extra(torus_obj):
    code = (
        "import sys; sys.modules['torch'] = sys.modules['safetensors'] = None\n"
        "import anisomesh; from anisomesh.errors import AnisomeshError\n"
        f"s = anisomesh.load({str(torus_obj)!r})\n"
        "result = anisomesh.remesh(s, n_vertices=50, embedding='hybrid', max_iterations=2)\n"
        "print(result.surface.n_points, result.embedding_name)\n"
        "try: anisomesh.remesh(s, n_vertices=50, embedding='neural', device='cuda')\n"
        "except AnisomeshError as error: print(error)\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    first, second = done.stdout.strip().splitlines()
    assert first == "50 hybrid"
    assert 'pip install "anisomesh[train]"' in second


@pytest.mark.slow
@pytest.mark.parametrize("loss", ["dot", "l2", "cosine"])
def test_the_network_of_the_paper_learns_too_and_embeds(files, tmp_path, loss):
    rows = train(options(tmp_path / "run", epochs=10, rate=1e-2, network=PAPER, loss=loss, noise_share=0.0), files)
    assert rows[-1]["loss"] < 0.9 * rows[0]["loss"]
    network, _ = load_weights(tmp_path / "run" / WEIGHTS)
    assert network.options == PAPER
    weights = tmp_path / "run" / WEIGHTS
    result = anisomesh.remesh(
        load_item(files.validation[0]).surface, n_vertices=100, embedding="neural", weights=weights, max_iterations=10
    )
    assert result.surface.n_points == 100
    np.testing.assert_allclose(result.embedding.points[:, 3:], predict(result.working, weights).extra, atol=1e-4)

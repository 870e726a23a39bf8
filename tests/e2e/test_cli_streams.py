"""Standard input and output in place of files, and formats that no suffix names."""

import io
import subprocess
import sys
from unittest import mock

import numpy as np
import pytest

from anisomesh.errors import MeshFileError
from anisomesh.io.known_formats import MESH_FORMATS
from anisomesh.io.meshes import load, save
from anisomesh.shapes import analytic as shapes
from conftest import CLI

TORUS = shapes.torus(n_major=12, n_minor=8)


@pytest.mark.parametrize("suffix", MESH_FORMATS)
def test_streams_hold_what_files_hold(tmp_path, suffix):
    stream = io.BytesIO()
    save(TORUS, stream, file_format=suffix[1:].upper())
    save(TORUS, tmp_path / f"a{suffix}")
    assert stream.getvalue() == (tmp_path / f"a{suffix}").read_bytes()
    stream.seek(0)
    np.testing.assert_array_equal(load(stream, file_format=suffix).faces, load(tmp_path / f"a{suffix}").faces)
    save(TORUS, tmp_path / "a.data", file_format=suffix)
    assert (tmp_path / "a.data").read_bytes() == stream.getvalue()
    assert load(tmp_path / "a.data", file_format=suffix[1:]).n_faces == TORUS.n_faces


def test_bad_formats_and_streams():
    with pytest.raises(MeshFileError, match="stream: has no name that ends in a format; give file_format"):
        load(io.BytesIO(b"x"))
    with pytest.raises(MeshFileError, match="unknown format 'docx'; expected one of"):
        save(TORUS, io.BytesIO(), file_format="docx")
    with pytest.raises(MeshFileError, match="stream: the file is empty"):
        load(io.BytesIO(), file_format="ply")
    with pytest.raises(MeshFileError, match="expected a stream of bytes"):
        load(io.StringIO("OFF"), file_format="off")


@pytest.mark.slow
def test_a_pipe(tmp_path):
    """Nothing but the mesh goes to standard output."""
    save(TORUS, tmp_path / "torus.off")
    command = [
        *CLI,
        "remesh",
        "-",
        "--input-format",
        "off",
        "-o",
        "-",
        "--output-format",
        "ply",
        "-n",
        "100",
        "--no-fit",
        "--metric",
        "uniform",
        "--max-iterations",
        "2",
    ]
    data = (tmp_path / "torus.off").read_bytes()
    done = subprocess.run(command, input=data, capture_output=True, check=True, timeout=300)
    assert load(io.BytesIO(done.stdout), file_format="ply").n_points == 100
    assert b"vertices   100" in done.stderr
    assert list(tmp_path.iterdir()) == [tmp_path / "torus.off"]
    cut = subprocess.run([*command, "-q"], input=data[:-40], capture_output=True, check=False, timeout=300)
    assert (cut.returncode, cut.stdout) == (1, b"")
    assert cut.stderr.startswith(b"anisomesh: error: <stdin>: cannot be read as OFF: truncated")


def test_info_of_standard_input(run_cli):
    stream = io.BytesIO()
    save(TORUS, stream, file_format="vtp")
    with mock.patch.object(sys, "stdin", io.TextIOWrapper(io.BytesIO(stream.getvalue()))):
        process = run_cli("info", "-", "--input-format", "vtp")
    assert "192" in process.stdout.replace(",", "")
    assert "1 component" in process.stdout


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["remesh", "-", "-o", "a.ply", "-n", 50], "-: give --input-format"),
        (["remesh", "a.ply", "-o", "-", "-n", 50], "-o -: give --output-format"),
        (["remesh", "a.ply", "-o", "-", "--output-format", "ply", "--json", "-n", 50], "both write to standard output"),
        (["remesh", "a.ply", "-o", "b.ply", "--report", "-", "-n", 50], "--report -: only the mesh goes to"),
        (["remesh", "a.ply", "-o", "b.x", "--output-format", "x", "-n", 50], "--output-format x: expected one of"),
        (["remesh", "a.ply", "-o", "b.x", "-n", 50], "b.x: expected a file name ending in one of"),
        (["remesh", "a.x", "--input-format", "x", "-o", "b.ply", "-n", 50], "--input-format x: expected one of"),
        (["info", "-"], "-: give --input-format"),
    ],
)
def test_wrong_usage(run_cli, tmp_path, words, message):
    save(TORUS, tmp_path / "a.ply")
    process = run_cli(*words, cwd=tmp_path)
    assert process.returncode == 2
    assert message in process.stderr
    assert process.stdout == ""

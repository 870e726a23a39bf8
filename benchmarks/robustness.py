"""The command line on every mesh of a folder: crashes, refusals, hangs, faults, new intersections.

Usage: python benchmarks/robustness.py [--ratios 1 0.2 0.1] [--embedding direct] [--only NAME]
       [--folders wild zeroshot test] [--fresh]

Rows are kept in benchmarks/out/robustness.jsonl; a stopped call is resumed by the same command. Exit code 1 if a run
crashed, hung, printed to stderr, or returned an invalid mesh without a warning.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path
from typing import Any

import anisomesh
from anisomesh.options import EMBEDDINGS

OUT = Path(__file__).parent / "out" / "robustness.jsonl"
HANG_SECONDS = 600
KEPT = ("components", "euler", "boundary_loops")  # keys of the report that have to be as for the input
FAULTS = ("nonmanifold_edges", "nonmanifold_vertices", "flat", "inverted", "duplicate_faces", "new_intersections")


def run(path: Path, ratio: float, embedding: str) -> dict[str, Any]:
    """Run the command on a mesh and return its outcome, with the report of a finished run."""
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "out.ply"
        words = ["remesh", str(path), "-o", str(out), "--ratio", str(ratio), "--embedding", embedding]
        command = [sys.executable, "-m", "anisomesh", *words, "--json", "--quiet"]
        row: dict[str, Any] = {"mesh": f"{path.parent.name}/{path.name}", "ratio": ratio, "embedding": embedding}
        start = time.perf_counter()
        try:
            done = subprocess.run(command, capture_output=True, text=True, timeout=HANG_SECONDS, check=False)
        except subprocess.TimeoutExpired:
            return {**row, "outcome": "hang", "seconds": HANG_SECONDS}
        row["seconds"] = round(time.perf_counter() - start, 2)
        lines = done.stderr.strip().splitlines()
        if done.returncode == 1 and len(lines) == 1 and not out.exists():
            return {**row, "outcome": "refused", "said": lines[0].replace(str(path), path.name)}
        if done.returncode != 0 or not out.exists():
            return {**row, "outcome": "crash", "said": done.stderr[-500:]}
        report = json.loads(done.stdout)
        row |= {key: report[key] for key in ("vertices", "vertices_asked", "validity", "warnings")}
        row["stderr"] = done.stderr.strip()
        anisomesh.load(out)  # the file has to be readable
    return {**row, "outcome": "done"}


def faults(row: dict[str, Any]) -> list[str]:
    """Return the faults of a result in words."""
    validity = row["validity"]
    pairs = [(name, validity[name], validity[f"{name}_input"]) for name in KEPT]
    found = [f"{name} {value} for {wanted}" for name, value, wanted in pairs if value != wanted]
    joined = validity.get("nonmanifold_edges_input")
    found += [
        f"{name} {validity[name]}"
        for name in FAULTS
        if validity[name] and not (joined and name.startswith("nonmanifold"))
    ]
    return found if validity["oriented"] else [*found, "not oriented"]


def read_rows() -> list[dict[str, Any]]:
    """Return the rows of earlier calls; rows of versions with other names of the figures are left out."""
    rows = [json.loads(line) for line in OUT.read_text().splitlines()] if OUT.exists() else []
    return [row for row in rows if "embedding" in row and (row["outcome"] != "done" or "stderr" in row)]


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--ratios", type=float, nargs="+", default=[1.0, 0.2, 0.1])
    parser.add_argument("--embedding", choices=EMBEDDINGS, default="direct")
    parser.add_argument("--folders", nargs="+", default=["wild", "zeroshot", "test"])
    parser.add_argument("--only", default="")
    parser.add_argument("--fresh", action="store_true", help="discard earlier rows")
    arguments = parser.parse_args()
    data = Path(os.environ.get("ANISOMESH_DATA", ""))
    paths = [path for folder in arguments.folders for path in sorted((data / folder).glob("*.*"))]
    paths = [path for path in paths if arguments.only in path.name]
    if not paths:
        print("no meshes: set ANISOMESH_DATA to the folder of real meshes", file=sys.stderr)
        return 2
    OUT.parent.mkdir(exist_ok=True)
    if arguments.fresh:
        OUT.unlink(missing_ok=True)
    known = {(row["mesh"], row["ratio"], row["embedding"]): row for row in read_rows()}
    chosen = []
    for ratio in arguments.ratios:
        for path in paths:
            key = (f"{path.parent.name}/{path.name}", ratio, arguments.embedding)
            if key not in known:
                known[key] = run(path, ratio, arguments.embedding)
                with OUT.open("a") as file:
                    file.write(json.dumps(known[key]) + "\n")
            row = known[key]
            chosen.append(row)
            said = faults(row) if row["outcome"] == "done" else [row.get("said", "")]
            name = f"{row['mesh'][:50]:<50} {ratio:>5.0%}"
            print(f"{name} {row['outcome']:<8} {row['seconds']:7.1f} s  {'; '.join(said)}", flush=True)
    return _summary(chosen)


def _summary(rows: list[dict[str, Any]]) -> int:
    bad = 0
    print("\n| folder | ratio | runs | refused | crashed | hung | faulty | faulty without warning | slowest |")
    print("|---|---|---|---|---|---|---|---|---|")
    for folder, ratio in dict.fromkeys((row["mesh"].split("/")[0], row["ratio"]) for row in rows):
        group = [row for row in rows if row["mesh"].startswith(folder) and row["ratio"] == ratio]
        count = Counter(row["outcome"] for row in group)
        done = [row for row in group if row["outcome"] == "done"]
        faulty = [row for row in done if faults(row)]
        silent = [row for row in done if row["stderr"] or (faults(row) and not row["warnings"])]
        bad += count["crash"] + count["hang"] + len(silent)
        slowest = max(row["seconds"] for row in group)
        print(
            f"| {folder} | {ratio:.0%} | {len(group)} | {count['refused']} | {count['crash']} | {count['hang']} "
            f"| {len(faulty)} | {len(silent)} | {slowest:.0f} s |"
        )
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())

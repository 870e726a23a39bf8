"""Keys of jobs: what a result depends on, as a hash."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from importlib.metadata import version

from anisomesh.batch.jobs import Job
from anisomesh.batch.options import FIELDS, TABLES, file_and_field, that_matter
from anisomesh.batch.places import hash_of, local_copy, stamp_of, suffix_of

FileFacts = dict[str, list[str]]
"""Stamp and SHA-256 of the files that a job reads, by what they are."""


def facts_of_files(job: Job, known: Mapping[str, list[str]] | None = None) -> FileFacts:
    """Return the stamps and hashes of the files that a job reads.

    Parameters
    ----------
    job
        The job.
    known
        Facts of an earlier run: a file with the same stamp is not read again.

    Raises
    ------
    MeshFileError
        If a file cannot be read.
    """
    facts: FileFacts = {}
    for name, place in job.files.items():
        stamp = stamp_of(place)
        before = (known or {}).get(name)
        if before is not None and before[0] == stamp:
            facts[name] = before
        else:
            with local_copy(place) as path:
                facts[name] = [stamp, hash_of(path)]
    return facts


def key_of(job: Job, files: FileFacts) -> str:
    """Return the hash of what the result of a job depends on: contents of files, options, format and version."""
    contents = {name: content for name, (_, content) in files.items()}
    options = {name: value for name, value in that_matter(job.options).items() if name not in (*TABLES, "weights")}
    for name in FIELDS:
        if name in files:
            place, field = file_and_field(name, options[name])
            options[name] = suffix_of(str(place)) + field
    weights = job.options.get("weights") if "weights" not in files else None
    parts = [contents, options, weights, suffix_of(job.output), version("anisomesh")]
    return hashlib.sha256(json.dumps(parts, sort_keys=True, default=str).encode()).hexdigest()

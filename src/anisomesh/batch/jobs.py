"""What a batch does: jobs, each with an input, an output and its options, checked before any work."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from anisomesh.batch.options import FIELDS, TABLES, Options, file_and_field, plain_options
from anisomesh.batch.places import absolute, exists, is_address, joined, suffix_of
from anisomesh.errors import OptionError
from anisomesh.io.known_formats import MESH_FORMATS
from anisomesh.levels.files import level_paths

_MISSING_SHOWN = 5  # missing files that a message names


@dataclass(frozen=True, kw_only=True)
class Job:
    """One remesh of a batch.

    Attributes
    ----------
    input
        The mesh: a path, or an address of a file system that fsspec knows, such as ``s3://bucket/part.ply``.
    output
        The file to write, whose suffix is its format; relative to the folder of the batch, or absolute, or an address.
    options
        Keywords of :func:`anisomesh.pipeline.remesh` with plain values: ``n_vertices``, ``ratio`` (also ``"20%"``),
        ``ratios`` for levels of detail, ``max_error`` or ``edge_length`` (also ``"0.1%"`` of the diagonal), and others;
        of ``features``, ``keep_points`` and ``density`` the names of text files. ``metric_file``, ``adapt_to`` and
        ``norm`` are as on the command line.
    place
        Where the job is written, such as a line of a manifest, for messages; empty if nowhere.
    """

    input: str
    output: str
    options: Options = field(default_factory=dict)
    place: str = field(default="", compare=False)

    @property
    def outputs(self) -> list[str]:
        """The files that are written: the output, or ``out.lod0.ply``, ``out.lod1.ply``, ... for levels of detail."""
        if "ratios" not in self.options:
            return [self.output]
        above, name = self.output[: -len(Path(self.output).name)], Path(self.output).name
        return [above + path.name for path in level_paths(name, len(self.options["ratios"]))]

    @property
    def files(self) -> dict[str, str]:
        """The files that the job reads, by what they are: ``"input"``, or the name of an option."""
        named = {name: self.options[name] for name in TABLES if name in self.options}
        for name in FIELDS:
            if name in self.options and (file := file_and_field(name, self.options[name])[0]) is not None:
                named[name] = file
        weights = self.options.get("weights")
        if weights is not None and exists(str(weights)):  # else the name of a pretrained network
            named["weights"] = str(weights)
        return {"input": self.input, **named}


def checked(jobs: Sequence[Job], folder: str) -> list[Job]:
    """Return jobs with absolute inputs and options in one form, after checking them all.

    Parameters
    ----------
    jobs
        The jobs.
    folder
        The folder, or the address of one, that outputs are relative to.

    Raises
    ------
    OptionError
        If the list is empty, an option is unknown or out of range, an input or another file is missing, a format is
        unknown, or two jobs write the same file, or one writes the input of any.
    """
    if not jobs:
        raise OptionError("no meshes were given; name files, folders or a manifest")
    found = [_in_one_form(job) for job in jobs]
    missing = [
        _placed(path, job)
        for job in found
        for name, path in job.files.items()
        if _is_missing(path, is_input=name == "input")
    ]
    if missing:
        more = f", and {len(missing) - _MISSING_SHOWN:,} more" if len(missing) > _MISSING_SHOWN else ""
        raise OptionError(f"no such file: {', '.join(missing[:_MISSING_SHOWN])}{more}")
    _check_outputs(found, folder)
    return found


def _is_missing(path: str, *, is_input: bool) -> bool:
    """Return whether a file is not there; an input that is a link to one which is not will be a row that says so."""
    return not (is_address(path) or exists(path) or (is_input and Path(path).is_symlink()))


def _placed(name: str, job: Job) -> str:
    return f"{name} ({job.place})" if job.place else name


def _in_one_form(job: Job) -> Job:
    where = job.place or f"the job for {job.input}"
    for place in (job.input, job.output):
        if suffix_of(place) not in MESH_FORMATS:
            expected = ", ".join(sorted(MESH_FORMATS))
            raise OptionError(f"{where}: {place}: expected a file name ending in one of {expected}")
    options = plain_options(job.options, where)
    found = replace(job, input=absolute(job.input), options=options)
    files = {name: absolute(place) for name, place in found.files.items() if name != "input"}
    fields = {name: files[name] + file_and_field(name, options[name])[1] for name in FIELDS if name in files}
    return replace(found, options=options | files | fields)


def _check_outputs(jobs: Sequence[Job], folder: str) -> None:
    """Raise OptionError if two jobs write the same file, or one writes a file that is an input."""
    inputs = {_identity(job.input) for job in jobs}
    writers: dict[str, Job] = {}
    for job in jobs:
        for name in job.outputs:
            output = _identity(joined(folder, name))
            if output in inputs:
                named = _placed(name, job)
                raise OptionError(f"{named} is an input and would be overwritten; choose another folder or name")
            first = writers.setdefault(output, job)
            if first is not job:
                how = "" if first.place and job.place else ", in a manifest, or name a folder that contains both"
                raise OptionError(
                    f"{_placed(first.input, first)} and {_placed(job.input, job)} would both be written to {name}; "
                    f"give them outputs of their own{how}"
                )


def _identity(place: str) -> str:
    return place if is_address(place) else str(Path(place).resolve())

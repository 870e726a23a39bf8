"""Many remeshes: jobs for the processes of this machine or of a cluster, a row for each, and going on after a stop."""

from anisomesh.batch.jobs import Job
from anisomesh.batch.running import Settings, run
from anisomesh.execution.engine import WorkerPool

__all__ = ["Job", "Settings", "WorkerPool", "run"]

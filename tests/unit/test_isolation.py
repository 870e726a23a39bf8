"""Calls in another process: results, errors and crashes are reported to the caller."""

import math
import os

import pytest

from anisomesh.errors import AnisomeshError
from anisomesh.execution.isolation import isolated


def test_result_and_error_come_back():
    assert isolated(math.hypot)(3.0, 4.0) == 5.0
    with pytest.raises(ValueError, match="math domain error"):
        isolated(math.sqrt)(-1.0)


def test_it_is_another_process():
    assert isolated(os.getpid)() != os.getpid()


def test_a_crash_is_an_error():
    with pytest.raises(AnisomeshError, match="ended without a result"):
        isolated(os.abort)()

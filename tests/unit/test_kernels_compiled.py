"""How kernels are compiled."""

import os

import pytest

from anisomesh._kernels.compiled import compiling


@pytest.mark.skipif(os.environ.get("NUMBA_DISABLE_JIT") == "1", reason="nothing is compiled")
def test_a_kernel_is_compiled_once_for_all_constants():
    @compiling()
    def half(number):
        return 0.5 * number

    @compiling()
    def sum_of_halves():
        total, number = half(7), 0
        while number < 3:
            total += half(number)
            number += 1
        return total

    assert sum_of_halves() == 5.0
    assert len(half.signatures) == 1

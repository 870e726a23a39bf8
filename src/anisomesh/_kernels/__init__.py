"""Numerical kernels: Numba only here. Arrays in, arrays out; no state and no import from the package.

Kernels release the GIL and work on a fixed chunk of facets or sites, so that a thread pool can run them and
the result does not depend on the number of threads. No kernel uses fast-math: the predicates rely on IEEE
rounding.
"""

"""Numerical kernels, the only modules that use Numba: arrays in, arrays out, no state, no imports from the package.

Kernels release the GIL and work on a fixed chunk of facets or sites, so that a thread pool can run them and results do
not depend on the number of threads. Predicates rely on IEEE rounding: no kernel uses fast-math, except for sums whose
terms may be reordered (``compiled.summing``).
"""

"""Benchmark suites: methods on meshes, run, resumed, measured and put into tables, see :class:`.suite.Suite`."""

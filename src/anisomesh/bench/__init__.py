"""Suites of remeshes that are run, measured, resumed and put into tables."""

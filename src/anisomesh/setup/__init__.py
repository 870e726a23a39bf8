"""From an input and the options to the tasks of the later stages."""

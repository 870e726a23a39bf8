"""Networks and the graphs that they work on."""

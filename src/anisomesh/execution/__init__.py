"""How long work may take, in how many threads and processes, in how much memory, and who hears of its steps."""

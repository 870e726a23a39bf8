"""``anisomesh figure``: the group, its commands, and what they share."""

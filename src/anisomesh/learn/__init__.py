"""Learning the embedding: what a network is trained on."""

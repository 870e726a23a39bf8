"""Application of trained networks: ``predict`` is the entry point, ``pretrained`` names the networks of the package."""

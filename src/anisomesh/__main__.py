"""``python -m anisomesh``: the same as the command ``anisomesh``."""

from anisomesh.cli.main import run

if __name__ == "__main__":
    run()

"""The command ``anisomesh``, also as ``python -m anisomesh``."""

import sys


def run() -> None:
    """Run the command line with the arguments of the process and exit with its status."""
    try:
        from anisomesh.cli.main import main  # takes a moment, in which Ctrl-C ends the process in one line too

        status = main(sys.argv[1:])
    except KeyboardInterrupt:
        print("anisomesh: interrupted", file=sys.stderr)
        status = 130
    sys.exit(status)


if __name__ == "__main__":
    run()

"""The command ``anisomesh``, also as ``python -m anisomesh``."""

import os
import signal
import sys
from types import FrameType

_INTERRUPTED = 130


def run() -> None:
    """Run the command line with the arguments of the process and exit with its status."""
    try:
        from anisomesh.cli.main import main  # takes a moment, in which Ctrl-C ends the process in one line too

        status = main(sys.argv[1:])
        _exit_at_interrupts()
    except KeyboardInterrupt:
        _exit_at_interrupts()
        _say_interrupted()
        status = _INTERRUPTED
    sys.exit(status)


def _exit_at_interrupts() -> None:
    """Let Ctrl-C end the process at once, since nobody catches an exception while the interpreter shuts down."""
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:  # else it is ignored, as in the background
        signal.signal(signal.SIGINT, _exit)


def _exit(_number: int, _frame: FrameType | None) -> None:
    _say_interrupted()
    os._exit(_INTERRUPTED)


def _say_interrupted() -> None:
    print("anisomesh: interrupted", file=sys.stderr, flush=True)


if __name__ == "__main__":
    run()

"""The command ``palpate``; also ``python -m palpate``."""
import signal
import sys

from ._native import command_line


def main() -> None:
    """Runs the command of the program's arguments and ends with its exit code."""
    # Python would only note an interrupt until the command is over.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    sys.exit(command_line(["palpate", *sys.argv[1:]]))


if __name__ == "__main__":
    main()

"""Where mapspeak starts, as `mapspeak` and as `python -m mapspeak`."""

import os
import sys

from mapspeak.installation import prefer_own_packages


def main() -> None:
    """Run the command line with the packages of its own environment."""
    try:
        prefer_own_packages(os.environ.get("PYTHONPATH", ""))
        from mapspeak.cli import main as run  # noqa: PLC0415 - only now its packages are the right ones

        run()
    except KeyboardInterrupt:  # before the command line takes care of it
        sys.stderr.write("Stopped.\n")
        sys.exit(130)


if __name__ == "__main__":
    main()

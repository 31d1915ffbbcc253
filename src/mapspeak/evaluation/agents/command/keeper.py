"""Run a client program, and end it with all its children when its trial's process is gone.

A trial's process may be killed at any moment; a program that asks a model must not go on, and cost,
without it. This file is started as a script, in its own process group, and imports nothing of ours.
Its standard input is open as long as the trial's process lives.
"""

import os
import signal
import subprocess
import sys
import threading


def main() -> int:
    """Run the program that its arguments name, and return its exit status."""
    program = subprocess.Popen(sys.argv[1:], stdin=subprocess.DEVNULL)  # noqa: S603 - the user's own
    signal.signal(signal.SIGTERM, lambda *_: program.terminate())
    threading.Thread(target=_end_with_input, daemon=True).start()
    return program.wait()


def _end_with_input() -> None:
    while os.read(0, 1024):  # no buffer: its lock would hold up the end of this process
        pass
    os.killpg(0, signal.SIGKILL)


if __name__ == "__main__":
    sys.exit(main())

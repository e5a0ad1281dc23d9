"""What is run: one file per command, and what the commands stand on."""

import sys

import simgap

try:
    simgap.check_packages()
except ImportError as error:
    if sys.argv[:1] != ["-m"]:
        raise
    # As the package of a command, before the command can say it.
    sys.stderr.write(f"error: {error}\n")
    raise SystemExit(2) from None

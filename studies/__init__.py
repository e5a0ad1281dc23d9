"""What is run: one file per command, and what the commands stand on."""

import sys

import simgap

AS_COMMAND = sys.argv[:1] == ["-m"]
"""Whether this is loaded as the package of a command, before the command can say anything."""

if AS_COMMAND:
    sys.excepthook = simgap.say_stopped
try:
    simgap.check_packages()
except ImportError as error:
    if not AS_COMMAND:
        raise
    sys.stderr.write(f"error: {error}\n")
    raise SystemExit(2) from None

"""`python -m nifkit` runs the program `nif`, with the same arguments."""
import os
import sys

from ._library import Error
from ._program import find_program

try:
    program = find_program()
    os.execv(program, ["nif", *sys.argv[1:]])
except (Error, OSError) as error:
    print(f"nifkit: {error}", file=sys.stderr)
    sys.exit(127)  # as a shell where there is no such program

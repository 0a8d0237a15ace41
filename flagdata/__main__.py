"""The command line as `python -m flagdata`."""

import sys

from flagdata.cli import main

if __name__ == "__main__":
    sys.exit(main())

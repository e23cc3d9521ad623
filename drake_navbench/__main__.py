"""The door `python -m drake_navbench COMMAND`: the command line `drake-navbench`."""

from __future__ import annotations

import sys

from drake_navbench.commands.main import main

if __name__ == "__main__":
    sys.exit(main())

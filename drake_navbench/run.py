"""The door `python -m drake_navbench.run`: the command `drake-navbench run`."""

from __future__ import annotations

import sys

from drake_navbench.commands.run import main

if __name__ == "__main__":
    sys.exit(main())

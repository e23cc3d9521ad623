"""Asks for known vulnerabilities of what the lock file names: `make audit`.

Exit status: 0 every package was looked up and none is known, 1 some are known, 3 nobody could be
asked about some package. Not to know is never a pass.
"""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Mapping
from typing import Any

EXIT_NONE_KNOWN, EXIT_KNOWN, EXIT_NOT_ASKED = 0, 1, 3
COMMAND = (sys.executable, "-m", "pip_audit", "--require-hashes", "--disable-pip")


def judge(output: str) -> tuple[list[str], int]:
    """Returns the lines to print and the exit status for pip-audit's JSON."""
    try:
        dependencies: list[Mapping[str, Any]] = json.loads(output)["dependencies"]
    except (ValueError, KeyError, TypeError):
        return ["no advisory service answers: nothing is known of any package"], EXIT_NOT_ASKED
    known = [
        f"{entry['name']} {entry['version']}: {vulnerability['id']}"
        for entry in dependencies
        for vulnerability in entry.get("vulns", [])
    ]
    skipped = [entry["name"] for entry in dependencies if "skip_reason" in entry]
    lines = list(known)
    if skipped or not dependencies:
        lines.append(
            f"no advisory service answers for {len(skipped)} of {len(dependencies)} packages"
        )
    elif not known:
        lines.append(f"{len(dependencies)} packages, no vulnerability known")
    if known:
        return lines, EXIT_KNOWN
    return lines, EXIT_NOT_ASKED if skipped or not dependencies else EXIT_NONE_KNOWN


def main() -> int:
    """Audits the lock file named by the first argument."""
    command = [*COMMAND, "--format", "json", "--requirement", sys.argv[1]]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    lines, status = judge(done.stdout)
    print("\n".join(lines))
    return status


if __name__ == "__main__":
    sys.exit(main())

"""`python docs/identification_page.py DIR` puts the page of an identification into the docs.

DIR is what `python -m drake_navbench identify --out DIR` has left. All of docs/identification.md
that follows its comment is replaced by the page, but for the page's title.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from drake_navbench.analysis.identification_page import PAGE_NAME

PAGE = Path(__file__).with_name("identification.md")
COMMENT = "<!-- What follows was made by the command. -->\n"


def with_page(text: str, page: str) -> str:
    """Returns the document's text with another page below the comment."""
    own, found, _ = text.partition(COMMENT)
    if not found:
        raise SystemExit(f"{PAGE}: expected the line {COMMENT.strip()}")
    _, _, body = page.partition("\n")
    return f"{own}{COMMENT}{body}"


def main() -> None:
    """Writes the document."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path, metavar="DIR")
    page = (parser.parse_args().folder / PAGE_NAME).read_text(encoding="utf-8")
    PAGE.write_text(with_page(PAGE.read_text(encoding="utf-8"), page), encoding="utf-8")


if __name__ == "__main__":
    main()

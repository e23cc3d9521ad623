"""The charting library of a page: BokehJS, taken from the installed package bokeh.

BokehJS draws the charts offline, from plain numbers, in less than 1.5 MB; plotly.js has 4.5 MB, and
Vega comes in a package with a JavaScript engine of its own. The package's files are read without
importing it: the import would take longer than writing the page.
"""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path

# The library itself, and its interface for making charts in JavaScript.
FILES = ("bokeh.min.js", "bokeh-api.min.js")


def chart_library() -> str:
    """Returns the library's source text; '' where the package bokeh is not installed."""
    found = find_spec("bokeh")
    if found is None or not found.submodule_search_locations:
        return ""
    folder = Path(found.submodule_search_locations[0]) / "server" / "static" / "js"
    try:
        texts = [(folder / name).read_text(encoding="utf-8") for name in FILES]
    except OSError:
        return ""
    # A script element in a page must not contain the text that ends the element.
    return "\n".join(texts).replace("</script", "<\\/script")

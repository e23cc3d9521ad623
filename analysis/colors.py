"""One colour a controller, the same in tables, figures and replays, safe for the colour-blind."""

from __future__ import annotations

import colorsys
import zlib

# Okabe and Ito's palette; its yellow and black are left to markers.
CONTROLLER_COLORS = {
    "dwb": "#d55e00",
    "rpp": "#0072b2",
    "teb": "#009e73",
    "teb_upstream": "#56b4e9",
    "mppi": "#e69f00",
    "mppi_nav2": "#cc79a7",
}
HUE_COUNT = 24
# Middling saturation and lightness: readable on white, and apart from the palette's own.
FALLBACK_LIGHTNESS, FALLBACK_SATURATION = 0.42, 0.55


def controller_color(name: str) -> str:
    """Returns the colour '#rrggbb' of a controller; unknown names get one that never changes."""
    if name in CONTROLLER_COLORS:
        return CONTROLLER_COLORS[name]
    hue = zlib.crc32(name.encode()) % HUE_COUNT / HUE_COUNT
    rgb = colorsys.hls_to_rgb(hue, FALLBACK_LIGHTNESS, FALLBACK_SATURATION)
    return "#" + "".join(f"{round(255 * channel):02x}" for channel in rgb)

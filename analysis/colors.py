"""One colour a controller, the same in tables, figures and replays, safe for the colour-blind."""

from __future__ import annotations

import colorsys
import zlib

# Okabe and Ito's palette, whose yellow and black are left to markers, and a violet that it lacks.
CONTROLLER_COLORS = {
    "dwb": "#d55e00",
    "rpp": "#0072b2",
    "teb": "#009e73",
    "teb_upstream": "#56b4e9",
    "mppi": "#e69f00",
    "mppi_nav2": "#cc79a7",
    "harmony": "#6a3d9a",
}
# Hues, in degrees, that none of these has or comes near to.
FALLBACK_HUES_DEG = (60, 78, 96, 114, 132, 238)
# Middling saturation, and lightnesses that are readable on white.
FALLBACK_SATURATION, FALLBACK_LIGHTNESSES = 0.55, (0.32, 0.5)


def controller_color(name: str) -> str:
    """Returns the colour '#rrggbb' of a controller; unknown names get one that never changes."""
    if name in CONTROLLER_COLORS:
        return CONTROLLER_COLORS[name]
    level, place = divmod(
        zlib.crc32(name.encode()) % (len(FALLBACK_LIGHTNESSES) * len(FALLBACK_HUES_DEG)),
        len(FALLBACK_HUES_DEG),
    )
    rgb = colorsys.hls_to_rgb(
        FALLBACK_HUES_DEG[place] / 360.0, FALLBACK_LIGHTNESSES[level], FALLBACK_SATURATION
    )
    return "#" + "".join(f"{round(255 * channel):02x}" for channel in rgb)

"""A costmap as a glTF model: one square on the floor whose texture has one pixel for each cell."""

from __future__ import annotations

import base64
import io
import json
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image
from pydrake.common import MemoryFile
from pydrake.geometry import InMemoryMesh, Mesh

from drake_navbench.analysis.cost_colors import palette, palette_rows
from drake_navbench.kernels.grid import Costmap

# Just above the floor, and below all that is drawn on it.
HEIGHT_M = 0.001
# glTF's numbers for "take the nearest pixel" and for component types.
NEAREST_FILTER = 9728
FLOAT32_COMPONENT, UINT16_COMPONENT = 5126, 5123
UNLIT = "KHR_materials_unlit"
# One mesh with a picture on it, lit by nothing: accessor 0 has its corners, 1 the picture's places
# of them, 2 the triangles.
SCENE_OF_A_SQUARE: dict[str, Any] = {
    "asset": {"version": "2.0"},
    "extensionsUsed": [UNLIT],
    "scene": 0,
    "scenes": [{"nodes": [0]}],
    "nodes": [{"mesh": 0}],
    "meshes": [
        {
            "primitives": [
                {"attributes": {"POSITION": 0, "TEXCOORD_0": 1}, "indices": 2, "material": 0}
            ]
        }
    ],
    "materials": [
        {
            "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}},
            "alphaMode": "BLEND",
            "doubleSided": True,
            "extensions": {UNLIT: {}},
        }
    ],
    "textures": [{"source": 0, "sampler": 0}],
    "samplers": [{"magFilter": NEAREST_FILTER, "minFilter": NEAREST_FILTER}],
}


def textured_square(costmap: Costmap) -> Mesh:
    """Returns the costmap as a glTF model of one textured square in the world frame."""
    x0, y0, up = costmap.origin_x, costmap.origin_y, HEIGHT_M
    x1, y1 = x0 + costmap.size_x_m, y0 + costmap.size_y_m
    # In glTF the second axis points up, so the world's (x, y, z) is written (x, z, -y).
    corners = np.array([[x0, up, -y0], [x1, up, -y0], [x1, up, -y1], [x0, up, -y1]], dtype="<f4")
    # Textures count from the upper left; the costmap's first row is the lowest.
    image = png(palette_rows()[costmap.costs[::-1]], palette())
    texture = np.array([[0, 1], [1, 1], [1, 0], [0, 0]], dtype="<f4")
    triangles = np.array([0, 1, 2, 0, 2, 3], dtype="<u2")
    gltf = _gltf(corners, texture, triangles, image)
    contents = json.dumps(gltf, separators=(",", ":")).encode()
    return Mesh(InMemoryMesh(mesh_file=MemoryFile(contents, ".gltf", "local costmap")))


def png(rows: NDArray[np.uint8], colors: NDArray[np.uint8]) -> bytes:
    """Returns a PNG image; rows: indices into `colors` (C, 4) RGBA, the first row on top."""
    image = Image.fromarray(rows, "P")
    image.putpalette(colors[:, :3].tobytes())
    written = io.BytesIO()
    image.save(written, "PNG", transparency=colors[:, 3].tobytes(), compress_level=9)
    return written.getvalue()


def _gltf(
    corners: NDArray[np.float32],
    texture: NDArray[np.float32],
    triangles: NDArray[np.uint16],
    image: bytes,
) -> dict[str, Any]:
    parts = [part.tobytes() for part in (corners, texture, triangles)]
    offsets = np.cumsum([0, *(len(part) for part in parts)])
    views = [
        {"buffer": 0, "byteOffset": int(offset), "byteLength": len(part)}
        for offset, part in zip(offsets, parts, strict=False)
    ]
    bounds = {"min": corners.min(axis=0).tolist(), "max": corners.max(axis=0).tolist()}
    accessor = {"componentType": FLOAT32_COMPONENT, "count": len(corners)}
    return SCENE_OF_A_SQUARE | {
        "images": [{"uri": _data_uri("image/png", image)}],
        "buffers": [
            {
                "byteLength": int(offsets[-1]),
                "uri": _data_uri("application/octet-stream", b"".join(parts)),
            }
        ],
        "bufferViews": views,
        "accessors": [
            accessor | bounds | {"bufferView": 0, "type": "VEC3"},
            accessor | {"bufferView": 1, "type": "VEC2"},
            {
                "bufferView": 2,
                "componentType": UINT16_COMPONENT,
                "count": len(triangles),
                "type": "SCALAR",
            },
        ],
    }


def _data_uri(kind: str, data: bytes) -> str:
    return f"data:{kind};base64,{base64.b64encode(data).decode()}"

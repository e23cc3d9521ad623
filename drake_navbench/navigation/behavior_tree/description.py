"""A behaviour tree as data, read from a robot file or a tree's XML file."""

from __future__ import annotations

from collections.abc import Iterator

from pydantic import Field

from drake_navbench.typed_files.typed_yaml import FrozenModel

# Nav2's navigators: the one drives to a goal, the other through several poses by one plan.
NAVIGATE_TO_POSE = "navigate_to_pose"
NAVIGATE_THROUGH_POSES = "navigate_through_poses"


class NodeDescription(FrozenModel):
    """A node of a behaviour tree, by the name that it has in Nav2's XML files."""

    node: str = Field(min_length=1, description="Type of the node, such as RecoveryNode or Spin.")
    name: str = Field("", description="Name of the node in the log; its type where none is given.")
    attributes: dict[str, str] = Field(
        default_factory=dict, description="Attributes as in the XML file."
    )
    children: tuple[NodeDescription, ...] = Field((), description="Children, in order.")
    line: int | None = Field(
        None, exclude=True, description="Line in the file that the node was read from."
    )

    def iterate(self) -> Iterator[NodeDescription]:
        """Yields the node and all nodes below it."""
        yield self
        for child in self.children:
            yield from child.iterate()

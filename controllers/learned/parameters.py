"""Parameters of a learned policy."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from pydantic import Field

from drake_navbench.controller import AskedSpeeds, ControllerParameters
from drake_navbench.typed_files.quantities import AngularSpeed, Speed

# The folder of the weights that come with the package.
WEIGHTS_FOLDER = Path(__file__).parent / "weights"


class LearnedPolicyParameters(ControllerParameters):
    """The network that drives, and its largest speeds."""

    weights: str = Field(
        "navigation",
        min_length=1,
        description="Weights of the policy: a name that comes with the package, or the path "
        "of a .npz file.",
    )
    max_linear_vel: Speed = Field(
        0.5, gt=0.0, description="Speed for a network output of 1, forward and backward [m/s]."
    )
    max_angular_vel: AngularSpeed = Field(
        2.0, gt=0.0, description="Yaw rate for a network output of 1 [rad/s]."
    )

    @property
    def weights_path(self) -> Path:
        """The file of the weights."""
        own = WEIGHTS_FOLDER / f"{self.weights}.npz"
        is_name = Path(self.weights).name == self.weights and own.is_file()
        return own if is_name else Path(self.weights).absolute()

    def files_read(self) -> Mapping[str, Path]:
        """Returns the file of the weights."""
        return {self.weights_path.name: self.weights_path}

    def asked_speeds(self) -> AskedSpeeds:
        """Returns the speeds that network outputs of 1 stand for."""
        return AskedSpeeds(self.max_linear_vel, -self.max_linear_vel, self.max_angular_vel)

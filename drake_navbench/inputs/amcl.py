"""The settings of AMCL, by the names and with the defaults of nav2_amcl."""

from __future__ import annotations

import math
from typing import Literal

from pydantic import Field, model_validator

from drake_navbench.typed_files.quantities import Angle, Length
from drake_navbench.typed_files.typed_yaml import FrozenModel

MotionModel = Literal["nav2_amcl::DifferentialMotionModel", "nav2_amcl::OmniMotionModel"]
DIFFERENTIAL: MotionModel = "nav2_amcl::DifferentialMotionModel"
OMNIDIRECTIONAL: MotionModel = "nav2_amcl::OmniMotionModel"
MOST_PARTICLES = 100_000


class AmclSettings(FrozenModel):
    """Monte Carlo localization on the map, as nav2_amcl does it with the likelihood field."""

    robot_model_type: MotionModel = Field(
        DIFFERENTIAL, description="How the odometry errs: that of a differential base or not."
    )
    alpha1: float = Field(0.2, ge=0.0, description="Error of turning by turning.")
    alpha2: float = Field(0.2, ge=0.0, description="Error of turning by way [rad^2/m^2].")
    alpha3: float = Field(0.2, ge=0.0, description="Error of way by way.")
    alpha4: float = Field(0.2, ge=0.0, description="Error of way by turning [m^2/rad^2].")
    alpha5: float = Field(0.2, ge=0.0, description="Sideways error by way; omnidirectional only.")
    laser_model_type: Literal["likelihood_field"] = Field(
        "likelihood_field", description="How a scan weighs a particle."
    )
    max_beams: int = Field(60, ge=2, description="About how many beams of a scan count.")
    laser_max_range: float = Field(
        100.0, description="What is farther away does not count [m]; below 0: the sensor's own."
    )
    laser_min_range: float = Field(
        -1.0, description="What is nearer does not count [m]; below 0: the sensor's own."
    )
    laser_likelihood_max_dist: Length = Field(
        2.0, gt=0.0, description="Hits farther from what the map shows count as so far [m]."
    )
    sigma_hit: Length = Field(0.2, gt=0.0, description="Spread of a hit about the map [m].")
    z_hit: float = Field(0.5, ge=0.0, le=1.0, description="Weight of hits.")
    z_rand: float = Field(0.5, ge=0.0, le=1.0, description="Weight of random readings.")
    min_particles: int = Field(500, ge=2, le=MOST_PARTICLES, description="At least so many.")
    max_particles: int = Field(2000, ge=2, le=MOST_PARTICLES, description="At most so many.")
    pf_err: float = Field(
        0.05, gt=0.0, description="Error of the distribution that the number of particles allows."
    )
    pf_z: float = Field(
        0.99, gt=0.0, description="Quantile of the normal distribution for that error."
    )
    update_min_d: Length = Field(
        0.25, ge=0.0, description="The filter is updated after more than this along x or y [m]."
    )
    update_min_a: Angle = Field(
        0.2, ge=0.0, description="The filter is updated after more than this turn [rad]."
    )
    resample_interval: int = Field(1, ge=1, description="Updates from one resampling to the next.")
    recovery_alpha_slow: float = Field(
        0.0, ge=0.0, le=1.0, description="Decay of the slow mean weight; 0: no random poses."
    )
    recovery_alpha_fast: float = Field(
        0.0, ge=0.0, le=1.0, description="Decay of the fast mean weight; 0: no random poses."
    )
    initial_xy_std_m: Length = Field(
        0.5, ge=0.0, description="Spread of the first particles on x and y, as of an RViz goal [m]."
    )
    initial_yaw_std_rad: Angle = Field(
        math.pi / 12.0, ge=0.0, description="Spread of their headings [rad]."
    )

    @model_validator(mode="after")
    def _check(self) -> AmclSettings:
        if self.max_particles < self.min_particles:
            raise ValueError(
                f"max_particles: expected at least min_particles, {self.min_particles}, got "
                f"{self.max_particles}"
            )
        return self

    @property
    def alphas(self) -> tuple[float, float, float, float, float]:
        """The five parameters of the motion model."""
        return (self.alpha1, self.alpha2, self.alpha3, self.alpha4, self.alpha5)

"""The settings of AMCL, by the names and with the defaults of nav2_amcl."""

from __future__ import annotations

import math
from typing import Literal

from pydantic import Field, model_validator

from drake_navbench.typed_files.quantities import Angle, Length, require_order
from drake_navbench.typed_files.typed_yaml import FrozenModel

MotionModel = Literal["nav2_amcl::DifferentialMotionModel", "nav2_amcl::OmniMotionModel"]
DIFFERENTIAL: MotionModel = "nav2_amcl::DifferentialMotionModel"
OMNIDIRECTIONAL: MotionModel = "nav2_amcl::OmniMotionModel"
MOST_PARTICLES = 100_000


class AmclSettings(FrozenModel):
    """Monte Carlo localization on the map, as nav2_amcl does it with the likelihood field."""

    robot_model_type: MotionModel = Field(
        DIFFERENTIAL, description="Motion model of the odometry: differential or omnidirectional."
    )
    alpha1: float = Field(0.2, ge=0.0, description="alpha1: variance of turning per squared turn.")
    alpha2: float = Field(
        0.2, ge=0.0, description="alpha2: variance of turning per squared distance [rad^2/m^2]."
    )
    alpha3: float = Field(
        0.2, ge=0.0, description="alpha3: variance of distance per squared distance."
    )
    alpha4: float = Field(
        0.2, ge=0.0, description="alpha4: variance of distance per squared turn [m^2/rad^2]."
    )
    alpha5: float = Field(
        0.2,
        ge=0.0,
        description="alpha5: variance of sideways motion per squared distance; "
        "omnidirectional only.",
    )
    laser_model_type: Literal["likelihood_field"] = Field(
        "likelihood_field", description="Model that weighs a particle by a scan."
    )
    max_beams: int = Field(
        60, ge=2, description="Approximate number of beams of a scan that are used."
    )
    laser_max_range: float = Field(
        100.0, description="Range above which beams are ignored [m]; negative: the sensor's own."
    )
    laser_min_range: float = Field(
        -1.0, description="Range below which beams are ignored [m]; negative: the sensor's own."
    )
    laser_likelihood_max_dist: Length = Field(
        2.0,
        gt=0.0,
        description="Largest distance of a hit to the map's next obstacle; farther hits count "
        "as so far [m].",
    )
    sigma_hit: Length = Field(
        0.2, gt=0.0, description="Standard deviation of a hit's distance to the map's obstacle [m]."
    )
    z_hit: float = Field(0.5, ge=0.0, le=1.0, description="Weight of hits in a beam's likelihood.")
    z_rand: float = Field(
        0.5, ge=0.0, le=1.0, description="Weight of random readings in a beam's likelihood."
    )
    min_particles: int = Field(
        500, ge=2, le=MOST_PARTICLES, description="Least number of particles."
    )
    max_particles: int = Field(
        2000, ge=2, le=MOST_PARTICLES, description="Largest number of particles."
    )
    pf_err: float = Field(
        0.05,
        gt=0.0,
        description="Largest error of the distribution (KLD sampling), which sets the number "
        "of particles.",
    )
    pf_z: float = Field(
        0.99,
        gt=0.0,
        description="Quantile of the normal distribution with which that error is kept.",
    )
    update_min_d: Length = Field(
        0.25, ge=0.0, description="Distance along x or y after which the filter is updated [m]."
    )
    update_min_a: Angle = Field(
        0.2, ge=0.0, description="Turn after which the filter is updated [rad]."
    )
    resample_interval: int = Field(
        1, ge=1, description="Number of filter updates between two resamplings."
    )
    recovery_alpha_slow: float = Field(
        0.0,
        ge=0.0,
        le=1.0,
        description="Decay rate of the slow average weight; 0: no random poses are added.",
    )
    recovery_alpha_fast: float = Field(
        0.0,
        ge=0.0,
        le=1.0,
        description="Decay rate of the fast average weight; 0: no random poses are added.",
    )
    initial_xy_std_m: Length = Field(
        0.5,
        ge=0.0,
        description="Standard deviation of the first particles' x and y [m]; the default is "
        "RViz's.",
    )
    initial_yaw_std_rad: Angle = Field(
        math.pi / 12.0,
        ge=0.0,
        description="Standard deviation of the first particles' headings [rad].",
    )

    @model_validator(mode="after")
    def _check(self) -> AmclSettings:
        require_order(self, "min_particles", "max_particles")
        return self

    @property
    def alphas(self) -> tuple[float, float, float, float, float]:
        """The five parameters of the motion model."""
        return (self.alpha1, self.alpha2, self.alpha3, self.alpha4, self.alpha5)

"""Parameters of Nav2's smoothers, with its names and defaults."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from drake_navbench.kernels.arrays import Array
from drake_navbench.plugins.releases import NEWEST_RELEASE, ReadBy, Release, before, since
from drake_navbench.typed_files.quantities import Count, Length, Number
from drake_navbench.typed_files.typed_yaml import FrozenModel

# The number of refinements before they were a parameter.
REFINEMENTS_OF_HUMBLE = 4
# Size and order of the Savitzky-Golay window before they were parameters.
WINDOW_UP_TO_KILTED = (7, 3)


class RefinementParameters(FrozenModel):
    """The number of times that a smoother goes over its path again."""

    do_refinement: bool = Field(True, description="Smooth the smoothed path again.")
    refinement_num: Count = Field(
        2, ge=0, description="Number of further smoothing passes [passes]"
    )


class RelaxationParameters(RefinementParameters):
    """Parameters of a smoother that relaxes a path sweep by sweep."""

    READ_BY: ClassVar[Mapping[str, ReadBy]] = {
        "refinement_num": since(Release.IRON, before(Release.IRON, REFINEMENTS_OF_HUMBLE)),
    }

    tolerance: Length = Field(
        1e-10,
        gt=0.0,
        description="A smoothing pass ends when a sweep moves the points by less than this in "
        "sum [m]",
    )
    w_data: Number = Field(0.2, ge=0.0, description="Pull of a point towards the unsmoothed path.")
    w_smooth: Number = Field(
        0.3, ge=0.0, description="Pull of a point towards the mean of its neighbours."
    )


class PartsParameters(FrozenModel):
    """The choice between smoothing a path as a whole and part by part, between its turns back."""

    nav2_release: Release = Field(
        NEWEST_RELEASE,
        description="Nav2 release whose rules apply: which parts are too short to smooth, how "
        "refinements are counted, whether moved points are read",
    )
    enforce_path_inversion: bool = Field(
        True,
        description="Smooth forward and reverse parts separately and keep the poses between them.",
    )


class SimpleSmootherParameters(RelaxationParameters, PartsParameters):
    """Parameters of SimpleSmoother, with Nav2's names and defaults."""

    READ_BY: ClassVar[Mapping[str, ReadBy]] = {"enforce_path_inversion": since(Release.KILTED)}

    plugin: Literal["nav2_smoother::SimpleSmoother"] = "nav2_smoother::SimpleSmoother"
    max_its: Count = Field(
        1000, ge=0, description="Number of the sweep before which a smoothing pass ends [sweeps]"
    )


class SavitzkyGolaySmootherParameters(RefinementParameters, PartsParameters):
    """Parameters of SavitzkyGolaySmoother, with Nav2's names and defaults."""

    READ_BY: ClassVar[Mapping[str, ReadBy]] = {
        "enforce_path_inversion": since(Release.KILTED),
        "poly_order": since(Release.LYRICAL),
        "window_size": since(Release.LYRICAL),
    }

    plugin: Literal["nav2_smoother::SavitzkyGolaySmoother"] = "nav2_smoother::SavitzkyGolaySmoother"
    window_size: Count = Field(
        7, ge=3, le=1001, description="Number of points in a window; odd [poses]"
    )
    poly_order: Count = Field(3, ge=0, le=20, description="Order of the polynomial in a window.")

    @model_validator(mode="after")
    def _check_window(self) -> Self:
        if self.window_size % 2 == 0:
            raise ValueError(f"window_size: got {self.window_size}, expected an odd number")
        if self.poly_order >= self.window_size:
            raise ValueError(
                f"poly_order: got {self.poly_order}, expected less than window_size "
                f"{self.window_size}"
            )
        window = (self.window_size, self.poly_order)
        if self.nav2_release < Release.LYRICAL and window != WINDOW_UP_TO_KILTED:
            raise ValueError(
                f"window_size, poly_order: got {window}, expected {WINDOW_UP_TO_KILTED}: "
                f"{self.nav2_release} has no other window"
            )
        return self


class OptimizerParameters(FrozenModel):
    """Parameters `optimizer.*`; IPOPT has no use for some."""

    linear_solver_type: Literal["SPARSE_NORMAL_CHOLESKY", "DENSE_QR"] = Field(
        "SPARSE_NORMAL_CHOLESKY", description="Option of Ceres; no effect here."
    )
    max_iterations: Count = Field(
        100,
        ge=1,
        description="Largest number of iterations; the path is then taken as it is [iterations]",
    )
    param_tol: Number = Field(1e-15, gt=0.0, description="Option of Ceres; no effect here.")
    fn_tol: Number = Field(
        1e-7,
        gt=0.0,
        description="Relative gain of an iteration below which the optimisation stops.",
    )
    gradient_tol: Number = Field(1e-10, gt=0.0, description="Option of Ceres; no effect here.")
    debug_optimizer: bool = Field(False, description="Print IPOPT's iterations.")


class ConstrainedSmootherParameters(FrozenModel):
    """Parameters of ConstrainedSmoother, with Nav2's names and defaults."""

    plugin: Literal["nav2_constrained_smoother::ConstrainedSmoother"] = (
        "nav2_constrained_smoother::ConstrainedSmoother"
    )
    minimum_turning_radius: Length = Field(
        0.4, ge=0.0, description="Turning radius below which curvature is penalised; 0: never [m]"
    )
    w_curve: Number = Field(30.0, ge=0.0, description="Weight of curvature above the limit [m^2]")
    w_cost: Number = Field(0.015, ge=0.0, description="Weight of the costmap's cost.")
    w_cost_cusp_multiplier: Number = Field(3.0, ge=0.0, description="Factor on w_cost at a cusp.")
    cusp_zone_length: Length = Field(
        2.5, ge=0.0, description="Length around a cusp over which that factor falls to 1 [m]"
    )
    w_dist: Number = Field(
        0.0, ge=0.0, description="Weight of the distance from the unsmoothed path [1/m^2]"
    )
    w_smooth: Number = Field(
        2_000_000.0,
        ge=0.0,
        description="Weight of second differences; depends on the spacing of the poses [1/m^2]",
    )
    cost_check_points: tuple[float, ...] = Field(
        (),
        description="Points fixed to the robot at which costs are read, one after another: x "
        "[m], y [m], weight.",
    )
    path_downsampling_factor: Count = Field(1, ge=1, description="Optimise every n-th pose [poses]")
    path_upsampling_factor: Count = Field(
        1,
        ge=0,
        description="Number of poses returned per pose of the input; 0: the optimised poses alone.",
    )
    reversing_enabled: bool = Field(
        True, description="Take the driving direction from the poses' headings."
    )
    keep_start_orientation: bool = Field(True, description="Keep the heading of the start.")
    keep_goal_orientation: bool = Field(True, description="Keep the heading of the goal.")
    optimizer: OptimizerParameters = OptimizerParameters()

    @model_validator(mode="after")
    def _check_points_are_triples(self) -> Self:
        points = self.cost_check_points
        if len(points) % 3 != 0:
            raise ValueError(
                f"cost_check_points: got {len(points)} numbers, expected a multiple of 3"
            )
        weights = points[2::3]
        if points and (min(weights) < 0.0 or max(weights) == 0.0):
            raise ValueError(
                f"cost_check_points: got weights {weights}, expected none negative, one above 0"
            )
        return self

    @property
    def normalized_check_points(self) -> Array:
        """(Q, 3) x m, y m and the square roots of the weights, scaled to a sum of 1.

        Without any, the robot's own origin.
        """
        if not self.cost_check_points:
            return np.array([[0.0, 0.0, 1.0]])
        points = np.array(self.cost_check_points, dtype=np.float64).reshape(-1, 3)
        points[:, 2] = np.sqrt(points[:, 2])
        points[:, 2] /= np.sum(points[:, 2])
        return points

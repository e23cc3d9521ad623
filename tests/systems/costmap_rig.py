"""A costmap that a lidar feeds, in a Diagram that is stepped."""

from pydrake.common.value import AbstractValue
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import ConstantVectorSource

from drake_navbench.inputs.lidar import LidarSettings
from drake_navbench.inputs.timeline import Timeline
from drake_navbench.inputs.world import World
from drake_navbench.trial.systems.costmap_system import CostmapSystem
from drake_navbench.trial.systems.lidar import Lidar
from drake_navbench.trial.systems.ports import NOTHING, read_object


class Rig:
    """A lidar and a costmap on a robot that stands at a pose."""

    def __init__(self, costmap: CostmapSystem, world: World, pose=(0.0, 0.0, 0.0)) -> None:
        builder = DiagramBuilder()
        self.costmap = builder.AddSystem(costmap)
        self.lidar = builder.AddSystem(Lidar(Timeline.constant(LidarSettings()), world))
        self.source = builder.AddSystem(ConstantVectorSource([*pose, 0.0, 0.0, 0.0]))
        for system in (self.lidar, costmap):
            builder.Connect(self.source.get_output_port(), system.GetInputPort("state"))
        builder.Connect(self.lidar.GetOutputPort("scan"), costmap.GetInputPort("scan"))
        self.simulator = Simulator(builder.Build())
        self.context = costmap.GetMyMutableContextFromRoot(self.simulator.get_mutable_context())
        self.request = costmap.GetInputPort("clear_request").FixValue(
            self.context, AbstractValue.Make(NOTHING)
        )

    def after(self, time_s: float):
        """Returns the costmap at a time; None before the first update."""
        self.simulator.AdvanceTo(time_s)
        return read_object(self.costmap.GetOutputPort("costmap"), self.context)

    def change_world(self, world: World) -> None:
        """Replaces the world that the lidar sees."""
        context = self.lidar.GetMyMutableContextFromRoot(self.simulator.get_mutable_context())
        parameter = context.get_mutable_abstract_parameter(self.lidar.world_parameter)
        parameter.set_value((world.segments, world.circles))

    def move_to(self, pose) -> None:
        """Puts the robot at a pose."""
        context = self.source.GetMyMutableContextFromRoot(self.simulator.get_mutable_context())
        self.source.get_mutable_source_value(context).SetFromVector([*pose, 0.0, 0.0, 0.0])

"""Plugins that move a body without wheels (docs/contract/sensors.md 6 and 12).

libgazebo_ros_planar_move.so sets its velocity; hector's and Ridgeback's force_based_move push it.
"""

import math

from bullet_gazebo.plugins.drive_topics import REST, DrivePlugin, choice
from bullet_gazebo.plugins.plugin_loader import PluginContext
from bullet_gazebo.plugins.sensor_topics import namespace_of
from robot_sim.constants import NANOSECONDS
from robot_sim.drives.odometry import POSE, TWIST, UNKNOWN, DeadReckoning, OdometrySample
from robot_sim.physics.pose import Vector, conjugate, rotate, to_rpy

RATE = 20.0  # [Hz]
INTEGRATED = (1e-3, 1e-3, UNKNOWN, UNKNOWN, UNKNOWN, 1e-3)  # covariances


class PlanarMovePlugin(DrivePlugin):
    """Sets the model's velocity in each step: it floats, and nothing tips it over."""

    def __init__(self, context: PluginContext) -> None:
        rate = context.rate("odometryRate", RATE)
        super().__init__(context, namespace_of(context, "", ""), rate, late=False)
        self._reports = rate > 0.0
        self._timeout = context.number("cmdTimeout", -1.0)
        self._commanded = self.sim.now  # [ns]
        self._seen: OdometrySample | None = None  # at the last report, if nothing was moved since
        self.begin(odometry=self._reports, tf=self._reports)

    def take(self, command: Vector) -> None:
        super().take(command)
        self._commanded = self.sim.now

    def update(self, now: int) -> None:
        if 0.0 <= self._timeout < (now - self._commanded) / NANOSECONDS:
            self.command = REST
        ahead, left, turn = self.command
        yaw = to_rpy(self.model.state()[0].orientation)[2]
        cosine, sine = math.cos(yaw), math.sin(yaw)
        linear = (cosine * ahead - sine * left, sine * ahead + cosine * left, 0.0)
        if self._reports and self.period.is_over(now):
            self.report(now)
        self.model.body.set_base_twist((linear, (0.0, 0.0, turn)))

    def report(self, now: int) -> None:
        super().report(now)
        if self._seen is None or self._seen.stamp != now:  # nobody has heard it
            self.sample(now)

    def sample(self, now: int) -> OdometrySample:
        sample = self.truth(now, POSE, TWIST)
        sample = sample._replace(position=(*sample.position[:2], 0.0))
        seen, self._seen = self._seen, sample
        if seen is None or now <= seen.stamp:
            return sample
        seconds = (now - seen.stamp) / NANOSECONDS
        (x, y, _), (u, v, _) = sample.position, seen.position
        yaw, before = (to_rpy(each.orientation)[2] for each in (sample, seen))
        east, north = (x - u) / seconds, (y - v) / seconds
        cosine, sine = math.cos(yaw), math.sin(yaw)
        turn = math.remainder(yaw - before, 2.0 * math.pi) / seconds
        linear = (cosine * east + sine * north, cosine * north - sine * east, 0.0)
        return sample._replace(linear=linear, angular=(0.0, 0.0, turn))

    def moved(self) -> None:
        self._seen = None
        self._commanded = min(self._commanded, self.sim.now)
        super().moved()


class ForceBasedMovePlugin(DrivePlugin):
    """Pushes a link by the errors of its model's velocity; the odometry adds velocities up."""

    def __init__(self, context: PluginContext) -> None:
        rate = context.rate("odometryRate", RATE)
        super().__init__(context, namespace_of(context, "", ""), rate, late=False)
        self._reports = rate > 0.0
        self._gains = [
            context.number(f"{axis}_velocity_p_gain", default)
            for axis, default in (("x", 1e4), ("y", 1e4), ("yaw", 100.0))
        ]
        base, model = context.text("robotBaseFrame", "base_footprint"), self.model
        self._link = base if base in model.link_names else model.description.root
        self._place = DeadReckoning()
        tf = self._reports and choice(context, "publishOdometryTf", default=True)
        self.begin(odometry=self._reports, tf=tf)

    def restart(self) -> None:
        self._place.restart()

    def update(self, now: int) -> None:
        pose, (linear, angular) = self.model.state()
        x, y, _ = rotate(conjugate(pose.orientation), linear)
        if self._reports:
            step = self.sim.world.time_step
            self._place.move(x * step, angular[2] * step, y * step)
            if self.period.is_over(now):
                self.report(now)
        errors = (self.command[0] - x, self.command[1] - y, self.command[2] - angular[2])
        along, across, turn = (gain * each for gain, each in zip(self._gains, errors, strict=True))
        force = rotate(pose.orientation, (along, across, 0.0))
        self.model.body.add_wrench(self._link, force, (0.0, 0.0, turn))

    def sample(self, now: int) -> OdometrySample:
        pose, (linear, angular) = self.model.state()
        x, y, _ = rotate(conjugate(pose.orientation), linear)
        return OdometrySample(
            now, self.frame, self.child, self._place.position, self._place.orientation,
            (x, y, 0.0), (0.0, 0.0, angular[2]), INTEGRATED, INTEGRATED,
        )  # fmt: skip


LIBRARIES = {
    "libgazebo_ros_planar_move.so": PlanarMovePlugin,
    "libhector_gazebo_ros_force_based_move.so": ForceBasedMovePlugin,
    "libridgeback_ros_force_based_move.so": ForceBasedMovePlugin,
}

"""A PID's gains at run time, and the topic that tells its state (docs/contract/ros_control.md 4)."""

import math
from collections.abc import Callable

import rospy
from control_msgs.msg import PidState
from dynamic_reconfigure.encoding import Config

from bullet_gazebo.control.pid import Gains, Pid, PidSample
from bullet_gazebo.ros.wire.conversions import to_time
from bullet_gazebo.ros.wire.dynamic_server import FIRST, DynamicServer, Parameter
from bullet_gazebo.ros.wire.thinning import ThinnedTopic, Thinner
from bullet_gazebo.simulator import Simulator

MOST = 100_000.0
PARAMETERS = [
    Parameter("p", "double", 0.0, -MOST, MOST, "Proportional gain."),
    Parameter("i", "double", 0.0, -MOST, MOST, "Integral gain."),
    Parameter("d", "double", 0.0, -1000.0, 1000.0, "Derivative gain."),
    Parameter("i_clamp_min", "double", 0.0, -MOST, 0.0, "Least integral term."),
    Parameter("i_clamp_max", "double", 0.0, 0.0, MOST, "Most integral term."),
    Parameter("antiwindup", "bool", False, False, True, "Clamp the integral, not only its term."),
]


class PidPorts:
    """A reconfigure server in the PID's namespace, and `state` below it if the PID is to be published.

    Gains are written back to the parameter server, at the start and whenever they change.
    """

    def __init__(
        self,
        sim: Simulator,
        thinner: Thinner,
        pid: Pid,
        namespace: str,
        changed: Callable[[], None],
    ) -> None:
        """`changed` is called under the simulator's lock when there are other gains."""
        self._sim = sim
        self._pid = pid
        self._namespace = namespace
        self._changed = changed
        self._server = DynamicServer(PARAMETERS, self._apply, namespace)
        self._publisher: rospy.Publisher | None = None
        if pid.publish_state:
            self._publisher = rospy.Publisher(f"{namespace}/state", PidState, queue_size=1)
            self._topic = ThinnedTopic(
                thinner, self._publisher.resolved_name, self._publisher.publish
            )
            pid.sink, pid.listeners = self._publish, self._publisher.get_num_connections

    def shutdown(self) -> None:
        """Takes all of it away."""
        self._server.shutdown()
        self._pid.sink = None
        if self._publisher is not None:
            self._topic.close()
            self._publisher.unregister()

    def _apply(self, config: Config, level: int) -> Config:
        if level != FIRST:
            names = [parameter.name for parameter in PARAMETERS]
            wrong = [name for name in names if not math.isfinite(config[name])]
            if wrong:
                rospy.logerr("%s: %s must be finite; the gains stay", self._namespace, wrong)
            else:
                with self._sim.lock:
                    self._pid.gains = _gains(config)
                    self._changed()
        gains = self._pid.gains
        config.update(
            p=gains.p, i=gains.i, d=gains.d, i_clamp_min=gains.i_min, i_clamp_max=gains.i_max,
            antiwindup=gains.antiwindup,
        )  # fmt: skip
        return config

    def _publish(self, sample: PidSample) -> None:
        publisher = self._publisher
        if publisher is None or not publisher.get_num_connections():
            return
        message = PidState(**sample._asdict())
        message.timestep = rospy.Duration.from_sec(sample.timestep)
        message.header.stamp = to_time(self._sim.now)
        self._topic.send(message)


def _gains(config: Config) -> Gains:
    return Gains(
        config["p"], config["i"], config["d"], config["i_clamp_max"], config["i_clamp_min"],
        bool(config["antiwindup"]),
    )  # fmt: skip

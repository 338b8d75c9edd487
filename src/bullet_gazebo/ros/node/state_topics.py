"""/clock, model_states and link_states (docs/contract/gazebo.md 1.3)."""

from collections.abc import Callable
from functools import partial

import rospy
from gazebo_msgs.msg import LinkStates, ModelStates
from rosgraph_msgs.msg import Clock

from bullet_gazebo.ros.common.messages import to_pose_msg, to_time, to_twist_msg
from bullet_gazebo.ros.common.publishing import SubscriberCount, ThinnedTopic, Thinner
from bullet_gazebo.ros.common.rospy_internals import set_time, stop_hearing_clock
from bullet_gazebo.simulator import Simulator

QUEUE = 10


class StateTopic(ThinnedTopic):
    """A topic with the state before each step, built only while somebody subscribes."""

    def __init__(
        self, name: str, kind: type, sim: Simulator, thinner: Thinner, make: Callable[[], object]
    ) -> None:
        self._subscribers = SubscriberCount()
        self._sim = sim
        publisher = rospy.Publisher(
            name, kind, subscriber_listener=self._subscribers, queue_size=QUEUE, tcp_nodelay=True
        )
        # A sample only says that there is news: the message is long, and made when it is sent.
        super().__init__(thinner, publisher.resolved_name, lambda now: publisher.publish(make()))

    def __call__(self, now: int) -> None:
        if self._subscribers.size:
            self.send(now)

    def flush(self) -> None:
        with self._sim.lock:  # make() reads the world
            super().flush()


class ClockTopic(ThinnedTopic):
    """/clock: on every tick, or at a frequency."""

    def __init__(self, sim: Simulator, thinner: Thinner, frequency: float) -> None:
        """`frequency` [Hz of simulated time, up to 1e9] is ~pub_clock_frequency; 0 means every tick."""
        super().__init__(thinner, "/clock", self._publish_time)
        self._publisher = rospy.Publisher("/clock", Clock, queue_size=QUEUE, tcp_nodelay=True)
        self._period = round(1e9 / frequency) if frequency > 0 else 0
        self._last = -self._period
        # With use_sim_time:=false this node, like all others, goes by the wall clock.
        self._sets_own_time = bool(rospy.get_param("/use_sim_time", True))
        if self._sets_own_time:
            stop_hearing_clock()
            set_time(to_time(sim.now))

    def __call__(self, now: int) -> None:
        if self._period and 0 <= now - self._last < self._period:  # negative after a reset: publish
            return
        self._last = now
        self.send(now)

    def _publish_time(self, now: int) -> None:
        time = to_time(now)
        if self._sets_own_time:
            set_time(time)
        self._publisher.publish(Clock(time))


def advertise_states(
    sim: Simulator, thinner: Thinner, clock_frequency: float, network: bool
) -> None:
    """Publishes /clock and, with `network`, the state topics, on the simulation's ticks."""
    sim.listeners.append(ClockTopic(sim, thinner, clock_frequency))
    if network:
        for name, kind, make in (
            ("~link_states", LinkStates, _link_states),
            ("~model_states", ModelStates, _model_states),
        ):
            sim.listeners.append(StateTopic(name, kind, sim, thinner, partial(make, sim)))


def _model_states(sim: Simulator) -> ModelStates:
    states = [(model.name, *model.state()) for model in sim.world.models.values()]
    return ModelStates(
        name=[name for name, _, _ in states],
        pose=[to_pose_msg(pose) for _, pose, _ in states],
        twist=[to_twist_msg(twist) for _, _, twist in states],
    )


def _link_states(sim: Simulator) -> LinkStates:
    states = [
        (f"{model.name}::{link}", *model.link_state(link))
        for model in sim.world.models.values()
        for link in model.link_names
    ]
    return LinkStates(
        name=[name for name, _, _ in states],
        pose=[to_pose_msg(pose) for _, pose, _ in states],
        twist=[to_twist_msg(twist) for _, _, twist in states],
    )

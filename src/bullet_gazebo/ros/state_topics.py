"""/clock, model_states and link_states (contract: gazebo_api.md section 1.3)."""

import threading
from collections.abc import Callable

import rospy
import rospy.impl.simtime
from gazebo_msgs.msg import LinkStates, ModelStates
from rosgraph_msgs.msg import Clock

from bullet_gazebo.ros.conversions import to_pose_msg, to_time, to_twist_msg
from bullet_gazebo.simulator import Simulator

QUEUE = 10
STOP_TIMEOUT = 1.0  # [s]
PERIOD = 0.001  # [s of wall time] between two messages of a thinned topic


class Audience(rospy.SubscribeListener):
    """Counts a topic's subscribers, so that nothing is made up for nobody."""

    def __init__(self) -> None:
        super().__init__()
        self.size = 0

    def peer_subscribe(
        self, topic_name: str, topic_publish: Callable, peer_publish: Callable
    ) -> None:
        self.size += 1

    def peer_unsubscribe(self, topic_name: str, num_peers: int) -> None:
        self.size = num_peers


class StateTopic:
    """A topic that shows the state before each step, while somebody listens."""

    def __init__(self, name: str, kind: type, make: Callable[[], object]) -> None:
        self._audience = Audience()
        self._make = make
        self._publisher = rospy.Publisher(
            name, kind, subscriber_listener=self._audience, queue_size=QUEUE, tcp_nodelay=True
        )

    def __call__(self, now: int) -> None:
        if self._audience.size:
            self._publisher.publish(self._make())


class ClockTopic:
    """/clock: on every tick in real time.

    Faster than real time no subscriber could follow: then messages are thinned by wall time, and the
    newest one is always sent.
    """

    def __init__(self, sim: Simulator, frequency: float) -> None:
        """`frequency` [Hz of simulated time] is ~pub_clock_frequency; 0 means every tick."""
        self._sim = sim
        self._publisher = rospy.Publisher("/clock", Clock, queue_size=QUEUE, tcp_nodelay=True)
        self._period = round(1e9 / frequency) if frequency > 0 else 0
        self._last = -self._period
        self._newest = 0
        self._news = threading.Event()
        self._ending = threading.Event()
        self._sender = threading.Thread(target=self._send_newest, name="clock", daemon=True)
        self._sender.start()
        rospy.on_shutdown(self._stop)
        # With use_sim_time:=false this node, like all others, goes by the wall clock.
        self._sets_own_time = bool(rospy.get_param("/use_sim_time", True))
        if self._sets_own_time:
            _stop_listening_to_clock()
            rospy.rostime._set_rostime(to_time(sim.now))

    def __call__(self, now: int) -> None:
        if self._period and 0 <= now - self._last < self._period:  # negative after a reset: publish
            return
        self._last = now
        if self._thinned():
            self._newest = now
            self._news.set()
        else:
            self._publish(now)

    def _thinned(self) -> bool:
        rate = self._sim.max_update_rate
        # Ticks of a paused world come from step(), as fast as they can be computed.
        return self._sim.lockstep or self._sim.paused or rate <= 0.0 or rate * PERIOD > 1.0

    def _send_newest(self) -> None:
        while not self._ending.wait(PERIOD):
            self._news.wait()
            self._news.clear()
            self._publish(self._newest)

    def _stop(self) -> None:
        self._ending.set()
        self._news.set()
        self._sender.join(STOP_TIMEOUT)

    def _publish(self, now: int) -> None:
        time = to_time(now)
        if self._sets_own_time:
            rospy.rostime._set_rostime(time)
        self._publisher.publish(Clock(time))


def _stop_listening_to_clock() -> None:
    """Ends rospy's own subscription to the topic that this node itself publishes.

    With /use_sim_time every node hears /clock. For the node that makes the time that is a message a
    millisecond over a socket to itself, a good part of its CPU time; the publisher tells rospy directly.
    rospy offers no way to say so, hence its private names.
    """
    subscription = getattr(rospy.impl.simtime, "_clock_sub", None)
    if subscription is not None:
        subscription.unregister()


def advertise_states(sim: Simulator, clock_frequency: float, network: bool) -> None:
    """Publishes /clock and, with `network`, the state topics, as the simulation ticks."""
    sim.listeners.append(ClockTopic(sim, clock_frequency))
    if network:
        sim.listeners.append(StateTopic("~link_states", LinkStates, lambda: _link_states(sim)))
        sim.listeners.append(StateTopic("~model_states", ModelStates, lambda: _model_states(sim)))


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

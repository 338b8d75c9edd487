"""Calls all of a simulator's interface with odd values: python3 -m support.stress.odd_calls SEED COUNT.

Types are right, values are not. Each request of a service has to be answered within a time limit: carried out
or refused. Its last line is a JSON object with the numbers of those that were sent, by kind.
"""

from __future__ import annotations

import contextlib
import json
import random
import sys
from collections import Counter
from collections.abc import Callable, Iterator
from typing import Any

import rosgraph
import rospy
import rosservice
import rostopic
from gazebo_msgs.srv import GetPhysicsProperties, GetWorldProperties, SetPhysicsProperties, SpawnModel
from geometry_msgs.msg import Point, Pose
from hypothesis import HealthCheck, Phase, given, seed, settings
from hypothesis import strategies as st
from std_srvs.srv import Empty
from support.ros.odd_requests import BOX, SIMPLE, messages, requests

from bullet_gazebo.clients.gz import METHOD
from cartpole.robot import ROBOT
from robot_envs.backends.ros.bringup import bring_up
from robot_envs.scene import Scene
from ros_calls.master import BadAnswer, Refused, call_node
from ros_calls.service import ServiceClient, ServiceFailed, ServiceGone

NODE = "/gazebo"
OFTEN = 50  # calls, after which the world is completed again
BOUND = 60.0  # [s] for an answer
TICKS = st.sampled_from([-1, 0, 1, 2, 50, 2**31 - 1])  # what is carried out takes its time
AT_ONCE = 5  # requests of one kind that are drawn at a time
XMLRPC = [
    *("getBusStats", "getBusInfo", "getMasterUri", "getPid", "getSubscriptions", "getPublications"),
    *("paramUpdate", "publisherUpdate", "requestTopic", "system.listMethods", METHOD, "none", ""),
]
WORDS = [
    "step", "pause", "reset", "/clock", "/gazebo/set_link_state", "http://127.0.0.1:1/", "http://",
    "TCPROS", "\0", "x" * 100_000,
]  # fmt: skip
NUMBERS = st.integers(-(2**31), 2**31 - 1) | st.floats()
ARGUMENTS = st.recursive(
    st.sampled_from(WORDS) | NUMBERS | st.text(max_size=8) | st.booleans() | st.binary(max_size=9),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=4), inner, max_size=3),
    max_leaves=6,
)
Call = Callable[[], object]


class OddCalls:
    """Endless calls of one simulator, of each kind in turn, drawn from the seed `number`."""

    def __init__(self, number: int) -> None:
        self._dice = random.Random(number)
        self.sent: Counter[str] = Counter()
        self.answered: Counter[str] = Counter()
        master = rosgraph.Master(rospy.get_name())
        _, subscribed, offered = master.getSystemState()
        self._address = master.lookupNode(NODE)
        services = sorted(name for name, nodes in offered if NODE in nodes)
        topics = sorted(name for name, nodes in subscribed if NODE in nodes and name != "/clock")
        self._makers = [self._service(name) for name in services]
        self._makers += [self._topic(name) for name in topics] * 2 + [self._xmlrpc] * 4

    def calls(self) -> Iterator[Call]:
        """What to call next."""
        while True:
            yield from self._dice.choice(self._makers)()

    def _draw(self, strategy: st.SearchStrategy[Any]) -> list[Any]:
        """Some values of a strategy, the same for the same seed."""
        found: list[Any] = []

        @seed(self._dice.randrange(2**32))
        @settings(max_examples=AT_ONCE, deadline=None, database=None, phases=[Phase.generate],
                  suppress_health_check=list(HealthCheck))  # fmt: skip
        @given(strategy)
        def take(value: Any) -> None:
            found.append(value)

        take()
        return found

    def _service(self, name: str) -> Callable[[], Iterator[Call]]:
        kind = rosservice.get_service_class_by_name(name)
        client = ServiceClient(name, kind, persistent=True, timeout=BOUND)
        strategy = requests(kind._request_class)
        if "ticks" in kind._request_class.__slots__:
            strategy = st.tuples(strategy, TICKS).map(with_ticks)

        def call_it(request: Any) -> None:
            self.sent["service"] += 1
            try:
                answer = client(request)
            except ServiceGone as fault:  # a model that is deleted takes its own along
                assert not name.startswith(f"{NODE}/"), f"{name}({request}): {fault}"
                return
            except ServiceFailed as fault:
                # Refused with a reason, as Gazebo does; or what the client can't put into bytes isn't sent.
                reasons = ("cannot process request: ", "can't be sent")
                assert any(each in str(fault) for each in reasons), f"{name}({request}): {fault}"
                return
            self.answered["service"] += 1
            assert getattr(answer, "success", True) or answer.status_message, f"{name}({request})"

        return lambda: ((lambda r=request: call_it(r)) for request in self._draw(strategy))

    def _topic(self, name: str) -> Callable[[], Iterator[Call]]:
        kind, _, _ = rostopic.get_topic_class(name)
        if kind is None:  # somebody publishes first
            return lambda: iter(())
        publisher = rospy.Publisher(name, kind, queue_size=100)

        def publish(message: Any) -> None:
            self.sent["topic"] += 1
            publisher.publish(message)

        strategy = messages(kind, SIMPLE)
        return lambda: ((lambda m=message: publish(m)) for message in self._draw(strategy))

    def _xmlrpc(self) -> Iterator[Call]:
        strategy = st.tuples(st.sampled_from(XMLRPC), st.lists(ARGUMENTS, max_size=4))
        return ((lambda p=pair: self._ask(*p)) for pair in self._draw(strategy))

    def _ask(self, method: str, arguments: list[Any]) -> None:
        self.sent["XML-RPC"] += 1
        # An answer, too, or nothing that XML can hold.
        with contextlib.suppress(Refused, BadAnswer, OverflowError, UnicodeEncodeError):
            call_node(self._address, method, *arguments, timeout=BOUND)
        self.answered["XML-RPC"] += 1


def with_ticks(drawn: tuple[Any, int]) -> Any:
    request, request.ticks = drawn
    return request


def complete() -> None:
    """Brings back what an odd request has deleted, by right."""
    world = ServiceClient("/gazebo/get_world_properties", GetWorldProperties, timeout=BOUND)
    bring_up(Scene([ROBOT]), lambda text: None)
    if "box" not in world().model_names:
        pose = Pose(position=Point(2.0, 0.0, 1.0))
        spawn = ServiceClient("/gazebo/spawn_urdf_model", SpawnModel, timeout=BOUND)
        assert spawn("box", BOX, "", pose, "world").success


def let_run() -> None:
    """Gives the world its usual time again: an odd request may make a step last for years, by right."""
    physics = ServiceClient("/gazebo/get_physics_properties", GetPhysicsProperties, timeout=BOUND)()
    answer = ServiceClient("/gazebo/set_physics_properties", SetPhysicsProperties, timeout=BOUND)(
        0.001, 1000.0, physics.gravity, physics.ode_config
    )
    assert answer.success, answer.status_message
    ServiceClient("/gazebo/unpause_physics", Empty, timeout=BOUND)()


def main(number: int, count: int) -> None:
    """Calls so often, and leaves a world that runs."""
    rospy.init_node("odd_calls", anonymous=True, disable_rostime=True, disable_signals=True)
    complete()
    odd = OddCalls(number)
    for done, call_it in enumerate(odd.calls()):
        if done >= count:
            break
        if done % OFTEN == 0:
            complete()
        call_it()
    let_run()
    print(json.dumps({"sent": odd.sent, "answered": odd.answered}), flush=True)


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))

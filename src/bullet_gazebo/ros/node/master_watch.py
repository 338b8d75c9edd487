"""The node's name at the master: refused to a second simulator, registered again at a new master."""

import threading
from collections.abc import Callable
from urllib.parse import urlsplit

import rospy

from bullet_gazebo.ros.common.rospy_internals import register_again, witness
from ros_calls import master
from ros_calls.master import NoAnswer, Refused, living_address

PERIOD = 10.0  # [s of wall time] between two questions
TIMEOUT = 5.0  # [s] of each question
LIVING = 5.0  # [s] for an answer of a busy node; that of a killed one comes at once
MISSES = 2  # unanswered questions, after which the master counts as gone
TIME = "/use_sim_time"
MASTERS_REASON = "new node registered with same name"


class NodeNameTaken(Exception):
    """A living node has the name; the text says which, and what to do."""


def refuse_twin(name: str) -> None:
    """Raises NodeNameTaken if a living node has that name: registering would end that node silently."""
    try:
        address = living_address(name, LIVING)
    except NoAnswer:  # the master has gone meanwhile; rospy waits for it
        return
    if address is not None:
        raise NodeNameTaken(
            f"{name} runs at {master.uri()} already ({address}): it stays, and this one ends. "
            f"{_two_masters()}; replace:=true (gzserver --replace) ends the one that runs"
        )


def _two_masters() -> str:
    host, port = master.host_and_port()
    scheme = urlsplit(master.uri()).scheme or "http"
    another = f"{scheme}://{host}:{port + 1 if port < 65535 else port - 1}"
    return f"Two simulators need two masters, for example ROS_MASTER_URI={another} before roslaunch"


class NameLoss:
    """Notices that the master ends this node because another one takes its name."""

    def __init__(self) -> None:
        self.happened = False
        rospy.core.add_preshutdown_hook(self._note)

    def _note(self, reason: str) -> None:
        self.happened = MASTERS_REASON in reason

    def text(self, name: str) -> str:
        """Returns what happened, in one line."""
        return (
            f"another node has taken the name {name} at {master.uri()}, so this simulator ends. "
            f"{_two_masters()}"
        )


class MasterWatch:
    """Asks the master every 10 s whether it knows this node, and registers the node again if not.

    It asks for a service, not for the node: a restarted master learns the node's name with the first topic
    that is added later.
    """

    def __init__(self, register: Callable[[float], None] = register_again) -> None:
        """`register` registers the node; its argument is the time limit of each call [s]."""
        self._register = register
        self._witness, self._address = witness()
        self._use_sim_time = rospy.get_param(TIME)
        self._misses = 0
        self._taken = ""  # address of another node with our name, once reported
        self._ending = threading.Event()

    def start(self) -> None:
        """Watches in a thread of its own until the node ends."""
        rospy.on_shutdown(self._ending.set)
        threading.Thread(target=self._watch, name="master", daemon=True).start()

    def _watch(self) -> None:
        while not self._ending.wait(PERIOD):
            self.look()

    def look(self) -> None:
        """Asks once, and acts on the answer."""
        try:
            try:
                known = master.call("lookupService", self._witness, timeout=TIMEOUT)
            except Refused:
                self._come_back()
            else:
                self._compare(str(known))
        except NoAnswer as fault:
            self._miss(fault)
            return
        if self._misses >= MISSES:
            rospy.loginfo("The master at %s answers again", master.uri())
        self._misses = 0

    def _miss(self, fault: NoAnswer) -> None:
        self._misses += 1
        if self._misses == MISSES and not self._ending.is_set():
            rospy.logwarn(
                "The master at %s is gone (%s). Existing connections stay, but no other node finds this "
                "simulator; it registers again once there is a master at that address",
                master.uri(), fault,
            )  # fmt: skip

    def _come_back(self) -> None:
        """Registers at a master that isn't the one we registered with."""
        if self._ending.is_set():  # we have unregistered ourselves
            return
        # Clients take the world for ready once it has its services, so the time comes first.
        if not master.call("hasParam", TIME, timeout=TIMEOUT):
            master.call("setParam", TIME, self._use_sim_time, timeout=TIMEOUT)
        self._register(TIMEOUT)
        self._misses = 0
        rospy.logwarn(
            "The master at %s was restarted: this node wasn't registered there, and is now. Parameters, such "
            "as robot descriptions and settings of controllers, went with the old master; set them again, or "
            "restart the launch", master.uri(),
        )  # fmt: skip

    def _compare(self, known: str) -> None:
        if known in (self._address, self._taken):
            return
        self._taken = known
        rospy.logwarn(
            "The master at %s was restarted, and another node (at %s) has the name %s there: clients don't "
            "find this simulator (at %s). End one of the two",
            master.uri(), known, rospy.get_name(), self._address,
        )  # fmt: skip

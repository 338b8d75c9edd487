"""A master that goes, or is started again: it doesn't know the simulator then, and nobody finds it."""

import threading
from collections.abc import Callable

import rospy

from bullet_gazebo.ros.wire.rospy_patches.registration import register_again, witness
from ros_calls import master
from ros_calls.master import NoAnswer, Refused

PERIOD = 10.0  # [s of wall time] between two questions
TIMEOUT = 5.0  # [s] of one
MISSES = 2  # unanswered questions, after which the master is gone
TIME = "/use_sim_time"


class MasterWatch:
    """Asks the master, now and then, whether it knows this node, and has it know it again.

    It is asked for a service, not for the node: a master that doesn't know the node learns its name with the
    first topic that comes later.
    """

    def __init__(self, register: Callable[[float], None] = register_again) -> None:
        """`register` tells the master what the node offers; its argument is the time limit of a call [s]."""
        self._register = register
        self._witness, self._address = witness()
        self._use_sim_time = rospy.get_param(TIME)
        self._misses = 0
        self._taken: str | None = None  # the address of another node's, once it was told
        self._ending = threading.Event()

    def start(self) -> None:
        """Watches in a thread of its own, until the node ends."""
        rospy.on_shutdown(self._ending.set)
        threading.Thread(target=self._watch, name="master", daemon=True).start()

    def _watch(self) -> None:
        while not self._ending.wait(PERIOD):
            self.look()

    def look(self) -> None:
        """Asks once, and does what is to be done."""
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
                "The master at %s is gone (%s). Who is connected stays so, but nobody else finds this "
                "simulator; it registers again once there is one at that address", master.uri(), fault,
            )  # fmt: skip

    def _come_back(self) -> None:
        """The master doesn't know us: it isn't the one that we registered with."""
        if self._ending.is_set():  # we have unregistered ourselves
            return
        # Clients take the world for ready once it has its services, so the time comes first.
        if not master.call("hasParam", TIME, timeout=TIMEOUT):
            master.call("setParam", TIME, self._use_sim_time, timeout=TIMEOUT)
        self._register(TIMEOUT)
        self._misses = 0
        rospy.logwarn(
            "The master at %s was started again: this node wasn't registered there, and is now. Parameters, "
            "such as robot descriptions and settings of controllers, went with the old one; who needs them "
            "sets them again, or restarts the launch", master.uri(),
        )  # fmt: skip

    def _compare(self, known: str) -> None:
        if known in (self._address, self._taken):
            return
        self._taken = known
        rospy.logwarn(
            "The master at %s was started again, and another node (at %s) has the name %s there: nobody "
            "finds this simulator (at %s). End one of the two",
            master.uri(), known, rospy.get_name(), self._address,
        )  # fmt: skip

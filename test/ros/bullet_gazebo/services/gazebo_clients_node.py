#!/usr/bin/env python3
"""Clients that hang, die or come in crowds; a node on the wall clock."""

import contextlib
import signal
import socket
import struct
import subprocess
import sys
import threading
import time
from concurrent.futures import ThreadPoolExecutor

import rosgraph
import rospy
import rostest
from gazebo_msgs.msg import ModelState
from gazebo_world import BOX
from geometry_msgs.msg import Point, Pose, Twist
from support.ros.calls import BOUND, gazebo, model_names, sim_time, time_passes
from support.ros.world_case import WorldCase
from support.stress.connections import address, header, packed

CROWD = 30
LISTENER = """
import rospy
from gazebo_msgs.msg import LinkStates, ModelStates
rospy.init_node("short_lived", anonymous=True, disable_rostime=True)
for kind, topic in ((LinkStates, "link_states"), (ModelStates, "model_states")):
    rospy.wait_for_message(f"/gazebo/{topic}", kind)
    rospy.Subscriber(f"/gazebo/{topic}", kind, lambda message: None)
print("listening", flush=True)
rospy.spin()
"""


def connect(service):
    """Opens a connection to the node that offers `service`, and says nothing."""
    uri = rosgraph.Master("/gazebo_clients").lookupService(f"/gazebo/{service}")
    return socket.create_connection(address(uri), BOUND)


class ClientsTest(WorldCase):
    def setUp(self):
        self.spawn("box", BOX, z=1.0)

    def check_alive(self):
        self.assertTrue(time_passes(), "time stands still")
        self.assertEqual(model_names(), ["ground_plane", "box"])

    def test_a_client_that_says_nothing_keeps_nobody_out(self):
        with contextlib.ExitStack() as silent:
            for beginning in (b"", b"\x10"):
                silent.enter_context(connect("get_model_state")).sendall(beginning)
            done = threading.Event()
            caller = threading.Thread(target=lambda: self.check_alive() or done.set(), daemon=True)
            caller.start()
            self.assertTrue(done.wait(BOUND), "services don't answer any more")

    def test_a_request_that_cannot_be_read_ends_the_connection(self):
        service = b"service=/gazebo/get_model_state"
        fields = (b"callerid=/raw", b"md5sum=*", service, b"persistent=1")
        with connect("get_model_state") as client:
            client.sendall(header(*fields))
            (length,) = struct.unpack("<I", client.recv(4, socket.MSG_WAITALL))
            client.recv(length, socket.MSG_WAITALL)
            client.sendall(packed(b"\xff" * 8))
            self.assertEqual(client.recv(1), b"")
        self.check_alive()

    def test_a_subscriber_that_is_killed_or_stopped_holds_nothing_up(self):
        for number in (signal.SIGKILL, signal.SIGSTOP):
            with subprocess.Popen([sys.executable, "-c", LISTENER], stdout=subprocess.PIPE) as client:
                self.assertEqual(client.stdout.readline(), b"listening\n")
                client.send_signal(number)
                self.check_alive()
                client.kill()
        self.check_alive()

    def test_a_crowd_is_served(self):
        def work(place):
            for step in range(5):
                pose = Pose(position=Point(place, step, 3.0))
                for answer in (
                    gazebo("get_model_state", "box", "world"),
                    gazebo("set_model_state", ModelState("box", pose, Twist(), "")),
                    gazebo("get_physics_properties"),
                ):
                    self.assertTrue(answer.success, answer.status_message)
                gazebo("pause_physics" if step % 2 else "unpause_physics")

        with ThreadPoolExecutor(CROWD) as pool:
            list(pool.map(work, range(CROWD)))
        gazebo("unpause_physics")
        self.check_alive()

    def test_stamps_are_the_walls_time_without_use_sim_time(self):
        stamp = gazebo("get_model_state", "box", "").header.stamp.to_sec()
        self.assertAlmostEqual(stamp, time.time(), delta=BOUND)
        self.assertLess(sim_time(), BOUND * 10)
        self.assertIs(rospy.get_param("/use_sim_time"), False)


if __name__ == "__main__":
    rospy.init_node("gazebo_clients")
    rostest.rosrun("cartpole", "gazebo_clients", ClientsTest)

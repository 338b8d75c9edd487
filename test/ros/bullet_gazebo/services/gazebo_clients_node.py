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
import unittest
from urllib.parse import urlsplit

import rosgraph
import rospy
import rostest
from gazebo_msgs.msg import ModelState
from gazebo_world import BOX, call, now, spawn
from geometry_msgs.msg import Point, Pose, Twist
from support.ros.calls import BOUND, wait_until

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
    place = urlsplit(rosgraph.Master("/gazebo_clients").lookupService(f"/gazebo/{service}"))
    return socket.create_connection((place.hostname, place.port), BOUND)


def packed(data):
    return struct.pack("<I", len(data)) + data


class ClientsTest(unittest.TestCase):
    def setUp(self):
        spawn("box", BOX, (0.0, 0.0, 1.0))
        self.addCleanup(call, "delete_model", "box")

    def check_alive(self):
        before = now()
        self.assertTrue(wait_until(lambda: now() > before), "time stands still")
        self.assertEqual(call("get_world_properties").model_names, ["ground_plane", "box"])

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
            client.sendall(packed(b"".join(packed(field) for field in fields)))
            (length,) = struct.unpack("<I", client.recv(4, socket.MSG_WAITALL))
            client.recv(length, socket.MSG_WAITALL)
            client.sendall(packed(b"\xff" * 8))
            self.assertEqual(client.recv(1), b"")
        self.check_alive()

    def test_a_subscriber_that_is_killed_or_stopped_holds_nothing_up(self):
        for number in (signal.SIGKILL, signal.SIGSTOP):
            with subprocess.Popen(
                [sys.executable, "-c", LISTENER], stdout=subprocess.PIPE
            ) as client:
                self.assertEqual(client.stdout.readline(), b"listening\n")
                client.send_signal(number)
                self.check_alive()
                client.kill()
        self.check_alive()

    def test_a_crowd_is_served(self):
        faults = []

        def work(place):
            try:
                for step in range(5):
                    pose = Pose(position=Point(place, step, 3.0))
                    answers = [
                        call("get_model_state", "box", "world"),
                        call("set_model_state", ModelState("box", pose, Twist(), "")),
                        call("get_physics_properties"),
                    ]
                    call("pause_physics" if step % 2 else "unpause_physics")
                    faults.extend(each.status_message for each in answers if not each.success)
            except (rospy.ROSException, rospy.ServiceException) as error:
                faults.append(str(error))

        threads = [threading.Thread(target=work, args=(place,)) for place in range(CROWD)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join(BOUND)
        self.assertEqual((faults, [t for t in threads if t.is_alive()]), ([], []))
        call("unpause_physics")
        self.check_alive()

    def test_stamps_are_the_walls_time_without_use_sim_time(self):
        stamp = call("get_model_state", "box", "").header.stamp.to_sec()
        self.assertAlmostEqual(stamp, time.time(), delta=BOUND)
        self.assertLess(now(), BOUND * 10)
        self.assertIs(rospy.get_param("/use_sim_time"), False)


if __name__ == "__main__":
    rospy.init_node("gazebo_clients")
    rostest.rosrun("cartpole", "gazebo_clients", ClientsTest)

"""Tests in the world of the launch file: what they add to it goes with them."""

import unittest

import rospy
from support.ros.calls import delete_model, spawn_model, wait_until
from support.ros.subscribed import Listener

SPAWNED = "SpawnModel: Successfully spawned entity"


class WorldCase(unittest.TestCase):
    def spawn(self, name, xml, namespace="/", **place):
        """Spawns a model; `place` is as for `spawn_model`."""
        answer = spawn_model(name, xml, namespace, **place)
        self.assertEqual((answer.success, answer.status_message), (True, SPAWNED))
        self.addCleanup(delete_model, name)

    def hear(self, topic, kind, **options):
        """Listens to a topic."""
        heard = Listener(topic, kind, **options)
        self.addCleanup(heard.close)
        return heard

    def publisher(self, topic, kind, **options):
        """A publisher that has found its subscriber."""
        publisher = rospy.Publisher(topic, kind, queue_size=5, **options)
        self.addCleanup(publisher.unregister)
        self.assertTrue(wait_until(publisher.get_num_connections), topic)
        return publisher

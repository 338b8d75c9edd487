"""What the simulator sends a window: the scene once, then the poses of its links."""

from concurrent.futures import ThreadPoolExecutor

import rosgraph
import rosservice
from bullet_gazebo_msgs.msg import SceneContacts, ScenePoses
from gazebo_msgs.msg import ModelState
from lockstep_case import LockstepCase, step
from support.ros.calls import delete_model, gazebo
from support.ros.subscribed import Listener

from bullet_gazebo.clients.gz import RemoteWorld

BALL = """<robot name="ball"><link name="ball">
<inertial><mass value="1"/><inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial>
<visual><geometry><sphere radius="0.1"/></geometry>
  <material name="r"><color rgba="1 0.5 0 0.25"/></material></visual>
<collision><geometry><sphere radius="0.1"/></geometry></collision></link></robot>"""


class Viewer(Listener):
    """Waits for a message that comes from now on."""

    def wait_for(self, wanted):
        first = len(self.messages)
        found = super().wait_for(lambda got: next(filter(wanted, got[first:]), None))
        assert found, "no such message in time"
        return found


def look(known=(), collisions=False):
    return gazebo("get_scene", list(known), collisions)


class SceneTest(LockstepCase):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        assert "/gazebo/get_scene" not in rosservice.get_service_list()
        world = RemoteWorld("/gazebo", rosgraph.get_master_uri())
        for _ in range(2):
            world.command("show")

    def view(self, topic="/gazebo/scene_poses", kind=ScenePoses):
        viewer = Viewer(topic, kind, connected=False)
        self.addCleanup(viewer.close)
        return viewer

    def test_models_are_described_once(self):
        scene = look()
        found = {model.name: model for model in scene.models}
        self.assertEqual(list(found), ["ground_plane", "cartpole"])
        joints = {joint.name: joint.kind for joint in found["cartpole"].joints}
        self.assertEqual(joints, {"stand_cart": "prismatic", "cart_pole": "continuous"})
        self.assertTrue(any(link.visuals for link in found["cartpole"].links))
        self.assertFalse(any(link.collisions for link in found["cartpole"].links))
        full = look(collisions=True).models[1]
        self.assertTrue(any(link.collisions for link in full.links))
        again = look([found["cartpole"].number], collisions=True)
        self.assertEqual([model.known for model in again.models], [False, True])
        self.assertEqual(again.models[0].links[0].visuals[0].kind, "plane")
        self.assertEqual(again.models[1].links, [])

    def test_the_version_changes_with_what_is_to_be_seen(self):
        versions = [look().version]
        for _ in range(2):
            self.spawn("ball", BALL, x=5.0, z=1.0)
            scene = look()
            versions.append(scene.version)
            color = scene.models[-1].links[0].visuals[0].color
            self.assertEqual((color.r, color.g, color.b, color.a), (1.0, 0.5, 0.0, 0.25))
            self.assertTrue(delete_model("ball").success)
            versions.append(look().version)
        self.assertTrue(gazebo("delete_light", "sun").success)
        scene = look()
        self.assertEqual(scene.lights, [])
        self.assertEqual(len({*versions, scene.version}), 6)

    def test_poses_are_those_of_the_links_in_the_scenes_order(self):
        self.spawn("ball", BALL, x=5.0, z=3.0)
        viewer = self.view()
        version = look().version
        state = ModelState(model_name="ball")
        state.pose.position.x, state.pose.position.y, state.pose.position.z = 1.0, 2.0, 3.5
        state.pose.orientation.w = 1.0
        self.assertTrue(gazebo("set_model_state", state).success)
        message = viewer.wait_for(lambda each: each.version == version and each.poses[-5] == 3.5)
        self.assertEqual(message.poses[-7:], (1.0, 2.0, 3.5, 0.0, 0.0, 0.0, 1.0))
        names = [(m.name, link.name) for m in look().models for link in m.links]
        self.assertEqual(len(message.poses), 7 * len(names))
        self.assertTrue(message.lockstep)
        pole = names.index(("cartpole", next(name for _, name in names if "pole" in name)))
        found = gazebo("get_link_state", "::".join(names[pole]), "world").link_state.pose.position
        for got, wanted in zip(
            message.poses[7 * pole : 7 * pole + 3], (found.x, found.y, found.z), strict=True
        ):
            self.assertAlmostEqual(got, wanted, places=5)

    def test_they_come_in_the_middle_of_a_long_request(self):
        viewer = self.view()
        viewer.wait_for(lambda each: True)
        begin = step(1).sim_time
        with ThreadPoolExecutor(1) as pool:
            answer = pool.submit(step, 20_000)
            message = viewer.wait_for(lambda each: begin + 1.0 < each.now.to_sec())
        self.assertLess(message.now.to_sec(), answer.result().sim_time)

    def test_they_come_while_nothing_moves(self):
        viewer = self.view()
        first = viewer.wait_for(lambda each: True)
        self.assertEqual(viewer.wait_for(lambda each: True).now, first.now)

    def test_contacts(self):
        self.spawn("ball", BALL, x=5.0, z=0.1)
        viewer = self.view("/gazebo/scene_contacts", SceneContacts)
        step(200)
        message = viewer.wait_for(lambda each: len(each.points) == 3)
        self.assertAlmostEqual(message.points[0], 5.0, places=2)
        self.assertAlmostEqual(message.points[2], 0.0, places=2)
        self.assertGreater(message.forces[2], 5.0)

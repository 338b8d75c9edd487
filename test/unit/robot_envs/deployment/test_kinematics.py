"""Links by the joints alone, beside what the physics tell of them."""

from pathlib import Path

import gymnasium
import numpy as np
import pytest

from robot_envs import LinkQuery, Pose, Robot, RobotEnv, RobotEnvError, StateQuery, Task
from robot_envs.deployment.kinematics import LinkView

FILES = Path(__file__).resolve().parents[3] / "data" / "robots"
EFFORTS = ("shoulder_effort_controller", "elbow_effort_controller")
POSE = Pose((0.3, -0.2, 0.1), (0.0, 0.0, 0.6, 0.8))
ARM = Robot(FILES / "two_link_arm.urdf", FILES / "two_link_arm.yaml", EFFORTS, pose=POSE)
LINKS = (("tip",), ("fore", "world"), ("two_link_arm::upper",), ("two_link_arm::tip", "upper"))
ALL = StateQuery(links=tuple(LinkQuery(*names) for names in LINKS))


class Flail(Task):
    query = ALL

    def action_space(self):
        return gymnasium.spaces.Box(-1.0, 1.0, (2,))

    def observation_space(self):
        return gymnasium.spaces.Box(-9.0, 9.0, (1,))

    def apply(self, action, state):
        return dict(zip(EFFORTS, (5.0 * float(each) for each in action), strict=True))

    def observe(self, state):
        self.seen = state
        return np.zeros(1)

    def reward(self, state, action):
        return 0.0


def test_they_are_those_of_the_physics() -> None:
    """Poses and velocities, however the robot stands."""
    task = Flail()
    env = RobotEnv(ARM, task)
    view = LinkView(ARM, ALL)
    env.reset(seed=1)
    env.action_space.seed(1)
    fastest = 0.0
    for _ in range(200):
        env.step(env.action_space.sample())
        found = view(task.seen.joints)
        assert list(found) == list(task.seen.links)
        for name, wanted in task.seen.links.items():
            assert found[name].pose.position == pytest.approx(wanted.pose.position, abs=1e-6)
            turn = np.dot(found[name].pose.orientation, wanted.pose.orientation)
            assert abs(turn) == pytest.approx(1.0, abs=1e-6)
            for mine, theirs in zip(found[name].twist, wanted.twist, strict=True):
                assert mine == pytest.approx(theirs, abs=1e-4)
                fastest = max(fastest, *map(abs, theirs))
    env.close()
    assert fastest > 3.0, "it moved"


@pytest.mark.parametrize(
    ("query", "words"),
    [
        (StateQuery(models=("ball",)), "asks for models, which aren't known"),
        (StateQuery(contacts_of=("tip",)), "asks for contacts, which aren't known"),
        (StateQuery(links=(LinkQuery("tipp"),)), "no link 'tipp'; did you mean 'tip'"),
        (StateQuery(links=(LinkQuery("tip", "bass"),)), "no link 'bass'; did you mean 'base'"),
        (StateQuery(links=(LinkQuery("tip"), LinkQuery("tip", "base"))), "'tip' twice"),
    ],
)
def test_what_joints_do_not_tell_is_refused(query: StateQuery, words: str) -> None:
    with pytest.raises(RobotEnvError, match=words):
        LinkView(ARM, query)


def test_a_robot_that_is_not_fixed_to_the_world() -> None:
    text = (FILES / "two_link_arm.urdf").read_text().replace('"world"', '"cart"')
    with pytest.raises(RobotEnvError, match="isn't fixed to the world: its joints don't determine"):
        LinkView(Robot(text), ALL)


def test_a_joint_that_nobody_tells() -> None:
    text = (FILES / "two_link_arm.urdf").read_text()
    before, after = text.split('<transmission name="elbow_transmission">')
    text = before + after.split("</transmission>", 1)[1]
    query = StateQuery(links=(LinkQuery("upper"),))
    LinkView(Robot(text), query)
    with pytest.raises(RobotEnvError, match="'tip' depends on the joint 'elbow', which has no"):
        LinkView(Robot(text), ALL)

"""Pictures and pages show all robots of a world, its objects and the file's models, where they are."""

import numpy as np
import pytest
from support.scenes.two_arms import LEFT, RIGHT, Volley

from robot_envs import InitialState, Pose, RobotEnv

HIT = np.array([0.3, 0.3, 0.6, 0.0])


@pytest.fixture
def arms(tmp_path):
    env = RobotEnv([LEFT, RIGHT], Volley(tmp_path), render_mode="rgb_array", width=320, height=160)
    yield env
    env.close()


def where(picture, channel):
    """The middle [pixels] of what has one colour most of all; NaN: nothing has."""
    colours = picture.astype(int)
    others = np.delete(colours, channel, axis=2).max(axis=2)
    rows, columns = np.nonzero(colours[..., channel] - others > 60)
    return np.array([columns.mean(), rows.mean()]) if len(rows) else np.full(2, np.nan)


def test_wall_plinth_and_ball_are_there_and_the_ball_where_it_is(arms):
    arms.reset(seed=0)
    before = arms.render()
    assert np.isfinite(where(before, 0)).all()  # the wall, of the world's file
    ball, plinth = where(before, 1), where(before, 2)
    assert ball[1] < plinth[1]  # on top of it
    for _ in range(45):
        arms.step(HIT)
    after = arms.render()
    assert where(after, 1)[0] < ball[0] - 0.5  # hit to the left
    assert np.allclose(where(after, 2), plinth, atol=0.5)


def test_both_arms_are_drawn_and_each_moves(arms):
    """The second one is told by its pixels alone: the first one and the ball stay."""
    pictures = []
    for joint in (None, "left::shoulder", "right::shoulder"):
        joints = {} if joint is None else {joint: 0.8}
        place = InitialState(joints, models={"ball": Pose((0.0, 0.0, 0.36))})
        arms.reset(options={"initial_state": place})
        pictures.append(arms.render().astype(int))
    still, left, right = pictures
    changed = [np.nonzero(np.abs(each - still).max(axis=2) > 40)[1] for each in (left, right)]
    assert all(len(columns) > 20 for columns in changed)
    assert changed[0].mean() < changed[1].mean() - 40  # [pixels]


def test_a_joint_that_no_state_tells_is_drawn_where_it_is(arms):
    pictures = []
    for angle in (0.0, 1.2):
        arms.reset(options={"initial_state": InitialState({"left::thread": angle})})
        pictures.append(arms.render())
    assert not np.array_equal(*pictures)


def test_a_page_has_the_same_links_where_they_are(arms, server):
    arms.reset(seed=0)
    shown = arms.draw_on(server)
    for _ in range(3):
        arms.step(HIT)
    shown()
    rows = shown.look().links
    names = [
        *("left::" + link for link in LEFT.links.links),
        *("right::" + link for link in ("base", "upper", "fore", "tassel")),
        "ball::rubber", "plinth::block", "wall::link",
    ]  # fmt: skip
    poses = arms.backend.poses(names)
    expected = {(*pose.position, *pose.orientation) for pose in poses}
    assert {tuple(row) for row in rows.tolist()} == expected

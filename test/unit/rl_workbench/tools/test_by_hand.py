"""Episodes driven by hand, in a real browser: keys, a gamepad, undo, verdicts; what can't be driven."""

import argparse
import threading
from pathlib import Path

import pytest
from support.pages.browser import Browser, find_browser, wait_for

import robot_envs.robots  # noqa: F401 - registers the environments
from rl_workbench.starting import Interrupt
from rl_workbench.tools.by_hand import driven
from rl_workbench.training import demonstrations
from rl_workbench.training.demonstrations import Demonstration, Origin, Recorder, load, paths

needs_browser = pytest.mark.skipif(not find_browser(), reason="no Chromium: apt-get install chromium")
PAD = "navigator.getGamepads = () => [{{axes: [0, {}], buttons: []}}]; 1"


class Hand:
    """Drives one episode; a context manager that has the page, and then the episode."""

    def __init__(self, env_id: str, **options: object) -> None:
        self.origin = Origin(env_id, options)
        self.episode: Demonstration | None = None
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._lines: list[str] = []

    def _run(self) -> None:
        env = self.origin.make({"render_mode": "rgb_array"})
        given = argparse.Namespace(host="127.0.0.1", port=None, no_browser=True, out=Path("hand"))
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr("rl_workbench.tools.by_hand.tell", self._lines.append)
            (self.episode,) = driven(Recorder(env, self.origin), env, range(3, 4), Interrupt(), given)
        env.close()

    def __enter__(self) -> Browser:
        self._thread.start()
        line = wait_for(lambda: self._lines and self._lines[0], "address")
        self._browser = Browser(line.rpartition(" ")[2], size=(900, 650))
        page = self._browser.__enter__()
        page.wait_for_text("seed 3, step 0, return 0.0")
        page.run("document.activeElement.blur()")
        return page

    def __exit__(self, *fault: object) -> None:
        if fault == (None, None, None):
            self._thread.join(60.0)
        self._browser.__exit__(*fault)


def steps(page: Browser) -> int:
    return int(page.text.rpartition("step ")[2].partition(",")[0])


@needs_browser
@pytest.mark.slow
def test_held_keys_are_a_robots_action_and_undone_ones_were_never(tmp_path: Path) -> None:
    hand = Hand("robot_envs/PickCube-v0", max_steps=60)  # 3 s
    with hand as page:
        page.wait_for_text("I +x, M -x, J +y, L -y, U +z, O -z, Y +grip, H -grip")
        page.key("keyDown", "i")
        wait_for(lambda: steps(page) > 5, "steps ahead")
        page.key("keyUp", "i")
        page.run(PAD.format(1))  # the same way back
        page.wait_for_text("step 60, ")
        page.run(PAD.format(0))
        page.click("Undo")
        page.wait_for_text("step 40, ")
        page.click("Success")
    episode = hand.episode
    assert episode is not None and episode.seed == 3 and episode.success
    assert not episode.terminated and not episode.truncated
    assert len(episode.actions) == 40
    env = hand.origin.make()
    ways = [tuple(action) for action in (episode.actions / env.action_space.high).tolist()]
    assert ways[0] == (1, 0, 0, 0) and set(ways) <= {ways[0], (-1, 0, 0, 0), (0, 0, 0, 0)}
    path = demonstrations.save(tmp_path, episode)
    assert len(list(demonstrations.replay(path, load(path), env))) == 41


@needs_browser
@pytest.mark.slow
def test_a_choice_stays_until_the_next_and_an_end_waits_for_its_driver() -> None:
    hand = Hand("CartPole-v1")
    with hand as page:
        page.key("keyDown", "l")
        page.wait_for_text("the episode has ended")
        page.key("keyUp", "l")
        page.click("Keep")
    assert hand.episode is not None and hand.episode.terminated
    assert set(hand.episode.actions.tolist()) == {1}


@pytest.mark.parametrize(
    ("env_id", "text"),
    [
        ("robot_envs/Quadruped-v0", "12 keys can't drive actions of Box"),
        ("", "--env-id names the environment to drive"),
    ],
)
def test_what_cannot_be_driven_by_hand_is_one_line(tmp_path, refused, env_id, text) -> None:
    given = [f"--env-id={env_id}"] if env_id else []
    out = tmp_path / "demos"
    assert text in refused("demonstrate", *given, f"--out={out}", "--no-browser", "--port=0")
    assert not paths(out)

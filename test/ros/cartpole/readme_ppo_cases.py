"""examples/ppo_over_ros.py runs unchanged, but for fewer steps."""

import importlib.util
import unittest
from pathlib import Path

from support.ros.programs import Place


@unittest.skipUnless(importlib.util.find_spec("stable_baselines3"), "./ws extras isn't installed")
class ReadmePpo(unittest.TestCase):
    def test_it_trains_over_ros_and_leaves_nothing(self):
        root = Path(__file__).resolve().parents[3]
        code = (root / "examples/ppo_over_ros.py").read_text()
        self.assertIn("60_000", code)
        self.assertIn("n_eval_episodes=5", code)
        place = Place()
        self.addCleanup(place.close)
        script = place.folder / "ppo.py"
        script.write_text(code.replace("60_000", "1_024").replace("episodes=5", "episodes=1"))
        training = place.start("python3", str(script))
        self.assertEqual(training.end(), 0, training.output)
        # It says how far it is, what it came to, and leaves what it learned.
        self.assertRegex(training.output, r"total_timesteps +\| 1024 ")
        self.assertIn("ep_len_mean", training.output)
        self.assertRegex(training.output, r"steps of 500: \d+\.\d+\s*\Z")
        self.assertGreater((place.folder / "ppo_cartpole.zip").stat().st_size, 10_000)
        self.assertEqual(place.left_after(), {})

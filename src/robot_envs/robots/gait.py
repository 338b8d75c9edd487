"""The reference gait of a legged robot: feet that step in turn as a commanded velocity asks."""

import math
from collections.abc import Sequence

import numpy as np

from robot_sim.physics.description import ModelDescription
from robot_sim.physics.dynamics import link_poses
from robot_sim.physics.pose import Pose

SMALL = 1e-4  # [rad, m], for slopes


class Gait:
    """Moves feet by the Jacobian of their legs in the stance.

    A foot is on the ground for half of a period, moves there against the command, and swings back through
    the air. A robot that follows its reference without slipping moves as commanded.

    Args:
        model: The robot's links and joints.
        joints: Names of the joints that move.
        stance: Positions (joints,) of these in the stance [rad].
        feet: Links of the feet.
        phases: When each foot is put down, as a share of the period.
        period: Of the gait [s].
        lift: How high the feet swing [m]; 0: they don't move.
    """

    def __init__(
        self, model: ModelDescription, joints: Sequence[str], stance: np.ndarray, feet: Sequence[str],
        phases: Sequence[float], period: float, lift: float,
    ) -> None:  # fmt: skip
        self.phases, self.period, self.lift = np.array(phases), period, lift

        def places(at: np.ndarray) -> np.ndarray:
            """Returns the middles (feet, 3) of the feet's lowest collisions, seen from the trunk."""
            poses = link_poses(model, Pose(), dict(zip(joints, at.tolist(), strict=True)))
            shapes = (
                [poses[foot].compose(each.pose).position for each in model.links[foot].collisions]
                or [poses[foot].position]
                for foot in feet
            )
            return np.array([min(each, key=lambda place: place[2]) for each in shapes])

        self._places = here = places(stance)
        moved = [places(stance + each) - here for each in SMALL * np.eye(len(joints))]
        self._inverse = np.linalg.pinv(np.array(moved).reshape(len(joints), -1).T / SMALL, 0.02)

    def on_ground(self, phase: float | None) -> np.ndarray:
        """Returns which feet (feet,) should be down at a phase in [0, 1); None: while it stands."""
        down = np.full(len(self.phases), True)
        return down if phase is None else (phase - self.phases) % 1.0 < 0.5 + 1e-9

    def offsets(self, phase: float | None, velocity: np.ndarray) -> np.ndarray:
        """Returns the joints' positions relative to the stance [rad] for a velocity ahead, left, about."""
        if phase is None or not self.lift:
            return np.zeros(len(self._inverse))
        ahead, left, about = velocity
        x, y, _ = self._places.T
        stride = np.array([ahead - about * y, left + about * x]) * self.period / 2.0
        since = (phase - self.phases) % 1.0  # it was put down
        swing = math.tau * (since - 0.5)
        ground = self.on_ground(phase)
        along = np.where(ground, 0.5 - 2.0 * since, -0.5 * np.cos(swing))
        up = np.where(ground, 0.0, self.lift * np.sin(swing))
        return self._inverse @ np.vstack([along * stride, up]).T.ravel()

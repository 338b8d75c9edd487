"""How far a joint may be off its trajectory (docs/contract/ros_control.md 3.5)."""

from typing import NamedTuple


class Tolerance(NamedTuple):
    """control_msgs/JointTolerance of position [rad, m] and velocity [1/s]; 0 or less: any error will do.

    Accelerations aren't measured, so none is ever off.
    """

    position: float = 0.0
    velocity: float = 0.0

    def violation(self, position_error: float, velocity_error: float) -> str:
        """Returns what is exceeded, or nothing."""
        if 0.0 < self.position < abs(position_error):
            return f"position, tolerance {self.position:g}"
        if 0.0 < self.velocity < abs(velocity_error):
            return f"velocity {velocity_error:f}, tolerance {self.velocity:g}"
        return ""

    def changed(self, wish: "Tolerance | None") -> "Tolerance":
        """Returns the tolerance with a goal's wishes: more than 0 overrides, less disables, 0 keeps."""
        if wish is None:
            return self
        return Tolerance(*(w if w else own for own, w in zip(self, wish, strict=True)))


class Constraints(NamedTuple):
    """The parameters `constraints`: a tolerance for each joint, and how late [ns] the end may come."""

    path: tuple[Tolerance, ...]
    goal: tuple[Tolerance, ...]
    goal_time: int = 0

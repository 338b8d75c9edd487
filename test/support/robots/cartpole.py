"""The cart-pole's environments, and its figures, written down a second time as an independent record."""

from dataclasses import dataclass

import numpy as np

GRAVITY = 9.8  # [m/s²]
IDS = tuple(f"cartpole/{name}-v0" for name in ("Balance", "Classic", "SwingUp"))
RICH = {  # options of each kind
    "sensor_noise": [0.001, 0.01, 0.001, 0.01],
    "sensor_delay": 2,
    "randomisation": {"mass": 0.2, "length": 0.1, "cart_friction": 0.5, "pole_friction": 0.001},
}
CONTROLLERS = {
    "states": {"type": "joint_state_controller/JointStateController", "publish_rate": 120},
    "cart": {"type": "effort_controllers/JointPositionController", "joint": "stand_cart",
             "pid": {"p": 100.0, "i": 0.01, "d": 10.0}},
}  # fmt: skip


@dataclass(frozen=True)
class CartPole:
    """Masses [kg], pivot to centre of mass [m], inertia about it [kg m²] (issue's figures)."""

    cart: float = 0.11377
    pole: float = 0.23243
    length: float = 0.25293
    inertia: float = 0.00438769663550614

    def derivative(self, state: np.ndarray, force: float = 0.0) -> np.ndarray:
        """Equations of motion, from the Lagrangian; the pole leans to -x for a positive angle.

        `state` (4,) is x, x', θ, θ'. With m the pole, M the cart, l the length, J the inertia:
        (M+m) x'' - m l cos θ θ'' + m l sin θ θ'² = F and (J+m l²) θ'' - m l cos θ x'' = m g l sin θ.
        """
        _, speed, angle, rate = state
        m, ml = self.pole, self.pole * self.length
        across = -ml * np.cos(angle)
        mass = np.array([[self.cart + m, across], [across, self.inertia + ml * self.length]])
        right = np.array([force - ml * np.sin(angle) * rate**2, GRAVITY * ml * np.sin(angle)])
        acceleration = np.linalg.solve(mass, right)
        return np.array([speed, acceleration[0], rate, acceleration[1]])


def cartpole_urdf() -> str:
    """Returns the robot's URDF: a stand on the world, a cart on a rail, a pole on the cart."""
    return """<robot name="cartpole">
  <link name="world"/>
  <link name="stand"><inertial><origin xyz="0 0 0.078463"/><mass value="1.0356"/>
    <inertia ixx="0.00182223142735174" ixy="0" ixz="0" iyy="0.097952048263061" iyz="0"
             izz="0.0962757383045765"/></inertial></link>
  <link name="cart"><inertial><origin xyz="0 0 0.00084171"/><mass value="0.11377"/>
    <inertia ixx="4.1669682348633e-05" ixy="0" ixz="0" iyy="0.0001144665328628" iyz="0"
             izz="0.000111738946564849"/></inertial></link>
  <link name="pole"><inertial><origin xyz="0 0 0.25293"/><mass value="0.23243"/>
    <inertia ixx="0.00438754518582167" ixy="0" ixz="0" iyy="0.00438769663550614" iyz="0"
             izz="1.79012590972362e-05"/></inertial></link>
  <joint name="grounding" type="fixed"><parent link="world"/><child link="stand"/></joint>
  <joint name="stand_cart" type="prismatic"><origin xyz="0 0 0.150"/><parent link="stand"/>
    <child link="cart"/><axis xyz="1 0 0"/>
    <limit lower="-0.5" upper="0.5" effort="30" velocity="7"/></joint>
  <joint name="cart_pole" type="continuous"><origin xyz="0 0 0.030"/><parent link="cart"/>
    <child link="pole"/><axis xyz="0 -1 0"/>
    <limit lower="-0.785398" upper="0.785398" effort="30" velocity="7"/></joint>
  <transmission name="t1"><type>transmission_interface/SimpleTransmission</type>
    <joint name="stand_cart">
      <hardwareInterface>hardware_interface/EffortJointInterface</hardwareInterface>
    </joint><actuator name="m1"/></transmission>
  <transmission name="t2"><type>transmission_interface/SimpleTransmission</type>
    <joint name="cart_pole">
      <hardwareInterface>hardware_interface/EffortJointInterface</hardwareInterface>
    </joint><actuator name="m2"/></transmission>
</robot>"""

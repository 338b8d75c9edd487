"""A rover with a sensor of each kind, in front of a crate."""

from dataclasses import replace
from typing import Any

import numpy as np
from gymnasium.spaces import Box
from support.scenes.rover import CRATE, PARTS, ROVER, Wheels

from robot_envs import InitialState, Object, Pose, StateQuery, WorldState

NOISE = '<noise type="gaussian"><type>gaussian</type><stddev>{}</stddev><bias_stddev>{}</bias_stddev></noise>'
SCAN = """<ray><scan><horizontal><samples>{}</samples><min_angle>-1.5</min_angle><max_angle>1.5</max_angle>
</horizontal></scan><range><min>0.05</min><max>5</max></range>{}</ray>"""
CAMERA = """<camera><horizontal_fov>1</horizontal_fov>
<image><width>16</width><height>12</height><format>{}</format></image>
<clip><near>0.05</near><far>8</far></clip>{}</camera>"""


def sensor(name: str, kind: str, rate: float, content: str, library: str, more: str = "") -> str:
    """Returns a sensor on the hull, with its plugin."""
    driver = f'<plugin name="{name}_driver" filename="libgazebo_ros_{library}.so">{more}</plugin>'
    return f"""<gazebo reference="hull"><sensor name="{name}" type="{kind}"><pose>0.22 0 0.1 0 0.1 0</pose>
        <update_rate>{rate}</update_rate>{content}{driver}</sensor></gazebo>"""


GYRO = f"<imu><angular_velocity><z>{NOISE.format(0.01, 0.1)}</z></angular_velocity></imu>"
SENSORS = [
    sensor(
        "front_laser", "ray", 50, SCAN.format(24, NOISE.format(0.02, 0.01)), "laser",
        "<topicName>scan</topicName><frameName>hull</frameName>",
    ),
    sensor(
        "sonar", "ray", 30, SCAN.format(5, ""), "range",
        "<topicName>sonar</topicName><gaussianNoise>0.01</gaussianNoise>",
    ),
    sensor(
        "imu", "imu", 100, GYRO, "imu_sensor",
        "<topicName>imu</topicName><frameName>hull</frameName><updateRateHZ>100</updateRateHZ>"
        "<gaussianNoise>0.001</gaussianNoise>",
    ),
    sensor(
        "camera", "camera", 50, CAMERA.format("R8G8B8", NOISE.format(0.05, 0.0)), "camera",
        "<cameraName>eye</cameraName>",
    ),
    sensor("deep", "depth", 50, CAMERA.format("R8G8B8", ""), "depth_camera",
           "<cameraName>deep</cameraName>"),
    sensor(
        "bumper", "contact", 50,
        "<contact><collision>hull_collision</collision></contact>", "bumper",
    ),
    """<gazebo><plugin name="old_imu" filename="libgazebo_ros_imu.so"><bodyName>hull</bodyName>
        <topicName>old_imu</topicName><updateRate>60</updateRate></plugin></gazebo>""",
]  # fmt: skip
SEEING = replace(ROVER, urdf=f'<robot name="seeing">{"".join([*PARTS, *SENSORS])}</robot>')
NAMES = ("front_laser", "sonar", "imu", "camera", "deep", "bumper", "old_imu")


class Look(Wheels):
    """Drives at a crate; all that is observed is what the sensors have measured."""

    max_steps = 170
    objects = (Object("crate", CRATE, Pose((3.0, 0.0, 0.1))),)
    query = StateQuery(sensors=NAMES)

    def action_space(self) -> Box:
        return Box(-0.3, 1.0, (2,), np.float32)

    def observation_space(self) -> Box:
        return Box(-np.inf, np.inf, (25,), np.float32)

    def initial_state(self, rng: np.random.Generator) -> InitialState:
        y = float(rng.uniform(-0.1, 0.1))
        return InitialState(models={"crate": Pose((0.5, y, 0.1))})

    def observe(self, state: WorldState) -> np.ndarray:
        ranges = np.clip(state.sensors["front_laser"].ranges, 0.0, 5.0)
        return np.append(ranges, state.sensors["imu"].angular_velocity[2])

    def reward(self, state: WorldState, action: np.ndarray) -> float:
        return float(len(state.sensors["bumper"].contacts))

    def info(self, state: WorldState) -> dict[str, Any]:
        return {"sensors": dict(state.sensors)}

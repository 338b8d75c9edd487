#!/usr/bin/env python3
"""Takes docs/images/laser.gif: the window's page draws the scan of a rover that turns among boxes.

./ws python3 test/support/pages/laser_gif.py docs/images/laser.gif
"""

import argparse
import contextlib
import io
import time
from pathlib import Path

from bullet_gazebo_msgs.srv import StepWorld, StepWorldRequest
from PIL import Image
from support.pages.browser import Browser
from support.pages.window_page import Output

from ros_calls.service import ServiceClient
from ros_utils import ros_controllers, ros_gazebo, ros_params, ros_urdf
from ros_utils.simulation import Simulation

DATA = Path(__file__).resolve().parents[2] / "data"
PANEL = 360  # [pixels] at the right of the page
NOTICE = ".mantine-Notification-closeButton"  # as that WebGL is drawn in software here
WHEELS = (-1.2, 1.2)  # [rad/s] of the left and the right one


def parse_args():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("out", type=Path)
    parser.add_argument("--frames", type=int, default=40)
    parser.add_argument("--ticks", type=int, default=200, help="[ms] from one to the next")
    parser.add_argument("--size", default="480x320", help="[pixels]")
    parser.add_argument(
        "--zoom", type=int, default=4, help="turns of the wheel away from the robot"
    )
    parser.add_argument("--tilt", type=int, default=60, help="the camera is lifted by it [pixels]")
    parser.add_argument("--topics", nargs="*", default=["/scan"])
    parser.add_argument("--settle", type=float, default=1.0, help="[s] until a picture is taken")
    parser.add_argument("--page", action="store_true", help="with the panel")
    parser.add_argument("--colours", type=int, default=48)
    return parser.parse_args()


def add_rover():
    """Puts the rover into the world, its controllers running."""
    robots = DATA / "robots"
    assert ros_params.ros_load_yaml_from_path(str(robots / "rover.yaml"))
    assert ros_urdf.urdf_load_from_path(str(robots / "rover.urdf"), "/robot_description")
    assert ros_gazebo.gazebo_spawn_urdf_param("/robot_description", "rover", pos_z=0.08)[0]
    assert ros_controllers.spawn_controllers_srv(["joints", "wheels"])


def main():
    args = parse_args()
    width, height = (int(each) for each in args.size.split("x"))
    pictures = []
    with contextlib.ExitStack() as stack:
        world = DATA / "worlds/around.world"
        simulation = stack.enter_context(Simulation(lockstep=True, custom_world_path=str(world)))
        stack.enter_context(simulation.active())
        add_rover()
        step = ServiceClient("/gazebo/step_world", StepWorld, persistent=True)
        window = Output(
            "env",
            *(f"{k}={v}" for k, v in simulation.environment().items() if k.startswith("ROS_")),
            "rosrun",
            "gazebo_ros",
            "gzclient",
            "--no-browser",
        )
        stack.callback(window.close)
        address = window.line("is the page").rpartition(" ")[2]
        page = stack.enter_context(Browser(address, size=(width + PANEL, height + 150)))
        page.wait_for_text("One step")
        page.click("Sensors")
        for topic in args.topics:
            page.click(topic)
        middle = width // 2, height // 2
        page.drag(middle, (middle[0], middle[1] + args.tilt))
        page.scroll(width // 2, height // 2, args.zoom)
        time.sleep(5.0 * args.settle)
        page.run(f"document.querySelectorAll('{NOTICE}').forEach(e => e.click())")
        for _ in range(args.frames):
            assert step(
                StepWorldRequest(ticks=args.ticks, controllers=["wheels"], commands=WHEELS)
            ).success
            time.sleep(args.settle)
            picture = Image.open(io.BytesIO(page.screenshot())).convert("RGB")
            pictures.append(picture if args.page else picture.crop((0, 0, width, height)))
    frames = [each.quantize(args.colours, dither=Image.Dither.NONE) for each in pictures]
    frames[0].save(
        args.out,
        save_all=True,
        append_images=frames[1:],
        duration=args.ticks // 2,
        loop=0,
        optimize=True,
    )
    print(f"{args.out}: {args.out.stat().st_size} bytes, {frames[0].width} x {frames[0].height}")


if __name__ == "__main__":
    main()

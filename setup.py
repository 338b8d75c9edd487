"""What is installed: read by catkin (CMakeLists.txt) and by pip, which need nothing of each other.

Name, commands and dependencies for pip are in pyproject.toml, all else of the package in package.xml.
"""

import shutil
from pathlib import Path
from xml.etree import ElementTree

from setuptools import find_packages, setup
from setuptools.command.build_py import build_py

# Files that are needed at run time and lie outside of src, and the folders of a wheel for them.
DATA = {
    "config/*.yaml": "rl_workbench/share/config",
    "urdf/*": "robot_envs/share/cartpole/urdf",
    "worlds/*": "robot_envs/share/cartpole/worlds",
    "config/robots/*": "robot_envs/share/cartpole/config/robots",
    "companions/cartpole_controller/config/*": "robot_envs/share/cartpole_controller/config",
}


class BuildWithData(build_py):
    """Puts the data beside the installed modules; catkin installs it also where ROS looks for it."""

    def run(self) -> None:
        super().run()
        if self.editable_mode:
            return
        for pattern, place in DATA.items():
            folder = Path(self.build_lib, place)
            folder.mkdir(parents=True, exist_ok=True)
            for path in sorted(Path().glob(pattern)):
                shutil.copy(path, folder)


setup(
    version=ElementTree.parse("package.xml").findtext("version"),
    packages=find_packages("src"),
    package_dir={"": "src"},
    package_data={
        "bullet_gazebo.physics.files": ["models.sdf"],
        "package_writing": [
            "parts/*",
            "drive/**/*",
            "reach/**/*",
            "template/**/*",
            "template/.gitignore.in",
        ],
        "rl_workbench.tools": ["page.html"],
    },
    cmdclass={"build_py": BuildWithData},
)

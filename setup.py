"""What catkin installs (CMakeLists.txt); pip reads pyproject.toml alone.

Data for the modules is in pyproject.toml's table, all else of the package in package.xml.
"""

import shutil
import tomllib
from pathlib import Path
from xml.etree import ElementTree

from setuptools import find_packages, setup
from setuptools.command.build_py import build_py

WHEEL = tomllib.loads(Path("pyproject.toml").read_text())["tool"]["hatch"]["build"]["targets"]["wheel"]


class BuildWithData(build_py):
    """Puts the data beside the installed modules; catkin installs it also where ROS looks for it."""

    def run(self) -> None:
        super().run()
        for folder, place in WHEEL["force-include"].items():
            shutil.copytree(folder, Path(self.build_lib, place), dirs_exist_ok=True)


setup(
    version=ElementTree.parse("package.xml").findtext("version"),
    packages=find_packages("src"),
    package_dir={"": "src"},
    package_data={
        "robot_sim.physics.files": ["elements.toml", "materials.toml", "models.sdf"],
        "package_writing": [
            "*.in",
            "drive/**/*",
            "reach/**/*",
            "template/**/*",
            "template/.gitignore.in",
        ],
    },
    cmdclass={"build_py": BuildWithData},
)

"""Where packages are. PyPI's xacro is ROS 2's and looks here for $(find package)."""

import rospkg


class PackageNotFoundError(KeyError):
    """No package of that name is on ROS_PACKAGE_PATH."""


def get_package_share_directory(package_name: str) -> str:
    """Return the folder of a ROS 1 package."""
    try:
        return str(rospkg.RosPack().get_path(package_name))
    except rospkg.ResourceNotFound as error:
        raise PackageNotFoundError(
            f"package '{package_name}' not found on ROS_PACKAGE_PATH; "
            "./ws --with FOLDER ... finds those in FOLDER"
        ) from error

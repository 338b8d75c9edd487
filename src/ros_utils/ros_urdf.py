"""Robot descriptions (xacro), expanded and put on the parameter server."""

from collections.abc import Sequence

from ros_calls import master as _master
from ros_utils._internal import log as _log
from ros_utils._internal import params as _params
from ros_utils._internal.packages import urdf_parse_from_path, urdf_parse_from_pkg

__all__ = [
    "urdf_load_from_path", "urdf_load_from_pkg", "urdf_parse_from_path", "urdf_parse_from_pkg",
]  # fmt: skip


def urdf_load_from_pkg(
    pkg_name: str,
    model_name: str,
    param_name: str,
    folder: str = "/urdf",
    ns: str | None = None,
    args_xacro: Sequence[str] | None = None,
) -> bool:
    """Expands a package's URDF or xacro file and sets it as a parameter.

    Args:
        pkg_name: ROS package.
        model_name: The file's name.
        param_name: Parameter to set, in `ns`; relative to the node's namespace if `ns` is None or
            "/".
        folder: The file's folder in the package.
        ns: Namespace of the parameter.
        args_xacro: Xacro arguments, ``"name:=value"`` each.

    Returns:
        True if the parameter was set. False, with an error in the log, if the package or file is
        missing, the file is broken, or no master answers.
    """
    xml = urdf_parse_from_pkg(pkg_name, model_name, folder, args_xacro)
    return xml is not None and _load(xml, param_name, ns)


def urdf_load_from_path(
    model_path: str, param_name: str, ns: str | None = None, args_xacro: Sequence[str] | None = None
) -> bool:
    """Expands a URDF or xacro file and sets it as a parameter. See `urdf_load_from_pkg`."""
    xml = urdf_parse_from_path(model_path, args_xacro)
    return xml is not None and _load(xml, param_name, ns)


def _load(xml: str, param_name: str, ns: str | None) -> bool:
    name = param_name if ns in (None, "", "/") else f"{ns}/{param_name}"
    try:
        _params.put(name, xml)
    except _master.MasterDown as fault:
        _log.error(f"parameter {name}: {fault}")
        return False
    return True

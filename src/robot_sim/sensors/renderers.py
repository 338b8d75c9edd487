"""Renderers of cameras' pictures by the names of `renderer:=`."""

from robot_sim.sensors.gl_renderer import GlRenderer
from robot_sim.sensors.rendering import RAYS, CameraRenderer, RayRenderer, RendererError

AUTO = "auto"
RENDERERS = (RAYS, GlRenderer.name, AUTO)


def make_renderer(name: str = RAYS) -> CameraRenderer:
    """Returns one of `RENDERERS`; `auto` is GL on a GPU, or else rays.

    Raises RendererError if it can't be had.
    """
    if name not in RENDERERS:
        raise RendererError(f"renderer '{name}' is not known; there are {', '.join(RENDERERS)}")
    if name == RAYS:
        return RayRenderer()
    try:
        renderer = GlRenderer()
    except RendererError:
        if name != AUTO:
            raise
        return RayRenderer()
    if name == AUTO and renderer.is_software:
        renderer.close()
        return RayRenderer()
    return renderer

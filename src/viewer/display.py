"""Whether a window can be opened; asked beforehand, since PyBullet would end the process if not."""

import ctypes
import ctypes.util
import os


def hindrance() -> str:
    """Why this process can't open a window; empty if it can."""
    name = os.environ.get("DISPLAY")
    if not name:
        return "DISPLAY isn't set"
    library = ctypes.util.find_library("X11")
    if library is None:
        return "there is no libX11"
    return "" if _opens(ctypes.CDLL(library), name) else f"DISPLAY={name} can't be opened"


def _opens(x11: ctypes.CDLL, name: str) -> bool:
    x11.XOpenDisplay.restype = ctypes.c_void_p
    x11.XOpenDisplay.argtypes = [ctypes.c_char_p]
    x11.XCloseDisplay.argtypes = [ctypes.c_void_p]
    display = x11.XOpenDisplay(name.encode())
    if display:
        x11.XCloseDisplay(display)
    return bool(display)

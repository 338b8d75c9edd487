"""What Gazebo calls physics properties: those of ODE's solver."""

from dataclasses import dataclass


@dataclass(frozen=True)
class SolverSettings:
    """ODE's figures, with sdformat's defaults (docs/contract/gazebo.md 2.20).

    PyBullet's solver is another one: only `iterations` acts on it. The others are kept for who reads them.
    """

    auto_disable_bodies: bool = False
    precon_iterations: int = 0
    iterations: int = 50
    sor: float = 1.3
    contact_surface_layer: float = 0.001  # [m]
    contact_max_correcting_vel: float = 100.0  # [m/s]
    cfm: float = 0.0
    erp: float = 0.2
    max_contacts: int = 20

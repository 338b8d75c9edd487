"""The flag that names a cluster, the same for every command that has it."""

import argparse

HELP = (
    "on a cluster of Ray's: HOST:PORT of its head, auto for the one that this machine belongs to, or "
    "local to start one on this machine alone"
)


def add_ray_flag(parser: argparse._ActionsContainer) -> None:
    """`--ray ADDRESS`; None if it isn't given."""
    parser.add_argument("--ray", metavar="ADDRESS", help=HELP)

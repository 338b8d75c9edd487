"""The templates of a package's files, and the values that fill them."""

import json
import shlex
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any
from xml.sax.saxutils import escape

import yaml
from jinja2 import Environment, FileSystemLoader, StrictUndefined

from package_writing import CannotWrite
from package_writing.gains import SAG, TRIPOD
from package_writing.standing import feet
from package_writing.survey import Motor, Survey
from package_writing.vehicle import DRIVE, Base

HERE = Path(__file__).resolve().parent
TEMPLATE = HERE / "template"
FILLED = ".in"  # suffix of templates
STATES = "joint_state_controller"


def literal(value: str | Mapping[str, str]) -> str:
    """Returns a text in double quotes, or a mapping of such, as both Python and YAML read it."""
    return json.dumps(value, ensure_ascii=False)


def _attribute(text: str) -> str:
    """Returns a text for an XML attribute in double quotes."""
    return escape(text, {'"': "&quot;"})


def _flow(value: str | Sequence[str]) -> str:
    """Returns a name or a list of names as YAML in one line."""
    text: str = yaml.safe_dump(value, default_flow_style=True, width=1e9)
    return text.removesuffix("...\n").strip()


def render(template: str, **values: Any) -> str:
    """Returns a template of this folder, filled in."""
    environment = Environment(
        loader=FileSystemLoader(HERE), undefined=StrictUndefined,
        trim_blocks=True, lstrip_blocks=True, keep_trailing_newline=True,
    )  # fmt: skip
    environment.filters.update(
        attribute=_attribute,
        flow=_flow,
        literal=literal,
        quote=shlex.quote,
        short="{:g}".format,
        xacro=lambda text: _attribute(text.replace("$(", "$$(").replace("${", "$${")),
    )
    return environment.get_template(template).render(values)


def fill(folder: Path, package: str, values: Mapping[str, Any]) -> None:
    """Writes the template's files, except the default robot, and those of the task."""
    tops = (TEMPLATE, HERE / values["task"].lower())
    for top, source in ((each, file) for each in tops for file in sorted(each.rglob(f"*{FILLED}"))):
        place = source.relative_to(top).with_suffix("")
        parts = [package if part == "package" else part for part in place.parts]
        target = folder.joinpath(*parts)
        target.parent.mkdir(parents=True, exist_ok=True)
        text = render(str(source.relative_to(HERE)), **values)
        target.write_text(text, encoding="utf-8")
        if text.startswith("#!"):
            target.chmod(target.stat().st_mode | 0o111)


def check_controllers(motors: Sequence[Motor], base: Base | None) -> None:
    """Raises CannotWrite if two controllers would have one name, those that every robot or a base has too."""
    joints: dict[str, str] = {}
    for motor in motors:
        name = motor.controller
        if name == STATES or (base and name == DRIVE):
            raise CannotWrite(
                f"the controller of the joint {literal(motor.joint)} would be called {name}, as another one "
                "is; rename the joint"
            )
        other = joints.setdefault(name, motor.joint)
        if other != motor.joint:
            raise CannotWrite(
                f"the joints {literal(other)} and {literal(motor.joint)} would share the controller "
                f"{name}; rename one of them"
            )


def goals(survey: Survey, starts: Mapping[str, float]) -> dict[str, tuple[float, float]]:
    """Returns where a test moves joints, and how near.

    It goes a quarter of the way up from where a joint starts; on a free base, which might fall, nowhere. The
    legs of one that balances sag: they have no i.
    """
    least = SAG / 2.0 if 0 < len(feet(survey.model)) < TRIPOD else 0.0
    share = 0.25 if survey.model.fixed_base else 0.0
    goals = {}
    for motor in (each for each in survey.motors if not each.wheel):
        start = starts.get(motor.joint, 0.0)
        near = max(0.025 * (motor.high - motor.low), least)
        goals[motor.joint] = (start + share * (motor.high - start), near)
    return goals

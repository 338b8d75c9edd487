"""The command lines of gzserver, gzclient, gz and spawn_model, the paths of models, imports of 0.2."""

import re

import pytest
from support.python import run_python

from bullet_gazebo.clients import gz, gzclient, spawn_model, spawner
from bullet_gazebo.clients.spawn_model import parse
from bullet_gazebo.node import gzserver
from bullet_gazebo.node.gzserver import parse_args
from bullet_gazebo.services.spawn_services import model_paths
from ros_calls.service import ServiceFailed, ServiceGone


@pytest.mark.parametrize(
    ("line", "wanted"),
    [
        (
            "physics:=ode -s libx.so --seed 7 w.world __name:=g -u --verbose -e dart --lockstep -r",
            {"world": "w.world", "paused": True, "physics": "dart", "lockstep": True, "seed": 7,
             "ignored": []},
        ),
        (
            "--video a.mp4 --video-size 320 240 w.world --video-rate 60",
            {"video": ["a.mp4"], "video_size": [320, 240], "video_rate": 60.0, "video_model": "",
             "world": "w.world"},
        ),
        *((line, {"world": "a.world"}) for line in (
            "-o a.world", "-o fast a.world", "--nix 5 a.world", "a.world -o")),
    ],
)  # fmt: skip
def test_options_stand_in_any_order(line, wanted):
    assert vars(parse_args(line.split())).items() >= wanted.items()


def test_the_environment_wins_over_a_launch_file(monkeypatch):
    seen = []

    def wait(name):
        raise gzserver.NodeNameTaken(name)

    monkeypatch.setattr(gzserver, "wait_for_master", wait)
    monkeypatch.setattr(gzserver, "parse_args", lambda argv: seen.append(parse_args(argv)))
    monkeypatch.setenv("GZSERVER_ARGS", "--physics mujoco --camera-scale 0.25 --seed 0")
    line = ["gzserver", "-e", "ode", "--camera-scale", "1", "my.world", "__name:=gazebo"]
    assert gzserver.main(line) == 1
    (args,) = seen
    assert (args.physics, args.camera_scale, args.seed) == ("mujoco", 0.25, 0)
    assert args.world == "my.world"


def test_negative_numbers_of_spawn_model():
    line = "-urdf -param p -model m -x -1e-05 -R -1.5 -J hinge -2e-1"
    options = parse(line.split())
    assert (options.x, options.R, options.joints) == (-1e-05, -1.5, [("hinge", -0.2)])


def test_spawn_model_waits_for_the_service_that_unpauses(monkeypatch):
    done = []
    monkeypatch.setattr(spawn_model, "wait_for_service", lambda name: done.append(f"wait {name}"))
    monkeypatch.setattr(spawn_model, "_call", lambda name, kind: done.append(name))
    monkeypatch.setattr(spawn_model, "_read", lambda *_: "<robot/>")
    monkeypatch.setattr(spawn_model, "_spawn", lambda *_: done.append("spawn"))
    options = spawn_model.parse(["-urdf", "-param", "r", "-model", "m", "-unpause"])
    assert spawn_model._run(options, b"") == 0
    unpause = "/gazebo/unpause_physics"
    assert done == ["wait /gazebo/spawn_urdf_model", "spawn", f"wait {unpause}", unpause]


@pytest.mark.parametrize(
    ("command", "line"),
    [(parse, line) for line in
     ("-urdf -model m", "-param p -model m", "-urdf -sdf -param p -model m", "-urdf -param p",
      "-gazebo -urdf -param p -model m", "-urdf -param p -model m -J hinge far")]
    + [(gz.main, line) for line in
       ("gz", "gz world", "gz world -m 0", "gz world -p 2", "gz nix")],
)  # fmt: skip
def test_a_wrong_command_line_of_spawn_model_or_gz(command, line):
    with pytest.raises(SystemExit) as end:
        command(line.split())
    assert end.value.code == 2


@pytest.mark.parametrize("line", ["gz sdf -p robot.urdf", "gz model -m bot -i", "gz stats"])
def test_another_tool_of_gz_says_what_there_is(line, capsys):
    assert gz.main(line.split()) == 2
    (told,) = capsys.readouterr().err.splitlines()
    assert f"there is no '{' '.join(line.split()[:2])}': " in told


def test_gz_without_a_master(monkeypatch, capsys):
    monkeypatch.setenv("ROS_MASTER_URI", "http://127.0.0.1:1")
    assert gz.main(["gz", "world", "-s"]) == 1
    assert "127.0.0.1:1" in capsys.readouterr().err


def test_model_paths_of_the_environment_and_of_packages(tmp_path, monkeypatch):
    for name in ("a", "mine/models", "mine"):
        (tmp_path / name).mkdir(parents=True, exist_ok=True)
    (tmp_path / "mine/package.xml").write_text(
        "<package><name>mine</name><version>1.0.0</version><description>d</description>"
        "<maintainer email='a@b.c'>m</maintainer><license>BSD</license>"
        "<export><gazebo_ros gazebo_model_path='${prefix}/models:${prefix}/nix'/></export></package>"
    )
    monkeypatch.setenv("GAZEBO_MODEL_PATH", f"{tmp_path}/a:/nix")
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(tmp_path))
    assert model_paths() == [f"{tmp_path}/a", f"{tmp_path}/mine/models"]


@pytest.mark.parametrize(
    ("line", "dead", "living", "anonymous"),
    [
        ("", [], [], False),
        ("", ["/gazebo_gui"], [], False),
        ("", [], ["/gazebo_gui"], True),
        ("__name:=gazebo_gui", [], ["/gazebo_gui"], False),
        ("__ns:=/second", [], ["/gazebo_gui"], False),
        ("__ns:=/second", [], ["/second/gazebo_gui"], True),
    ],
)
def test_another_window_keeps_its_name(line, dead, living, anonymous, master, monkeypatch):
    monkeypatch.delenv("ROS_NAMESPACE", raising=False)
    master.nodes.update(dict.fromkeys(dead, "http://127.0.0.1:1"))
    master.nodes.update(dict.fromkeys(living, master.uri))
    taken = []
    monkeypatch.setattr(gzclient, "init_node", lambda name, _, anonymous: taken.append(anonymous))
    gzclient.become_node(["gzclient", *line.split()])
    assert taken == [anonymous]


@pytest.mark.parametrize(("fault", "warns"), [(ServiceGone, False), (ServiceFailed, True)])
def test_a_spawner_that_ends_with_the_simulator_has_nothing_to_complain_of(monkeypatch, fault, warns):
    """roslaunch and rostest end both at the same time."""

    class Manager:
        def load(self, name):
            return True

        def running(self, timeout):
            raise fault("gone")

    told, leave = [], []
    monkeypatch.setattr(spawner.rospy, "logwarn", lambda *text: told.append(text))
    monkeypatch.setattr(spawner.rospy, "on_shutdown", leave.append)
    monkeypatch.setattr(spawner.rospy, "spin", lambda: None)
    spawner._Spawner(Manager()).run(["arm_controller"], stopped=True)
    leave[0]()
    assert bool(told) == warns


class LateManager:
    """One that comes up after some waits in vain."""

    def __init__(self, waits):
        self.waits = waits

    def wait(self, services, timeout):
        self.waits -= 1
        return services[0] if self.waits >= 0 else None


@pytest.mark.parametrize(
    ("spawns", "waits", "found"),
    [
        ([[0, 0], [1, 0], [1, 0], [0, 1]], 3, True),  # also where it has just ended
        ([[0, 1], [0, 1]], 1, False),
        ([[], []], 1, False),  # Gazebo itself says nothing
    ],
)
def test_a_spawner_waits_while_a_model_is_being_spawned(monkeypatch, spawns, waits, found):
    monkeypatch.setattr(spawner.rospy, "get_param", lambda *_: False)  # time has begun
    monkeypatch.setattr(spawner, "spawns", lambda: spawns.pop(0))
    assert (spawner._find(LateManager(waits), 30.0) is None) == found


@pytest.mark.parametrize(
    ("old", "told"),
    [
        ("physics.world", "bullet_gazebo.physics is robot_sim.physics now"),
        ("control.pid", "bullet_gazebo.control.pid is robot_sim.control.pid now"),
        ("ros.plugins.plugin_loader", r"bullet_gazebo.ros(.plugins)? is bullet_gazebo(.plugins)? now"),
        ("nothing", "No module named 'bullet_gazebo.nothing'"),
        ("plugins.nothing", "No module named 'bullet_gazebo.plugins.nothing'"),
    ],
)
def test_an_old_import_says_where_it_is(old, told):
    found = run_python(f"import bullet_gazebo.{old}", check=False)
    assert re.search(f"ModuleNotFoundError: {told}\n$", found.stderr)


def test_a_public_name_says_where_it_is_and_works():
    found = run_python("from bullet_gazebo import Controller; print(Controller.__module__)")
    assert "robot_sim.Controller now" in found.stderr and "robot_sim" in found.stdout

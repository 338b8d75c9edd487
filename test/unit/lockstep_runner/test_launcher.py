"""lockstep.py's command line."""

import os
import sys

import pytest
from support.python import run

from lockstep_runner.launcher import _parse
from lockstep_runner.script import AfterImport, seed_everything


@pytest.mark.parametrize(
    ("given", "triggers", "script", "arguments"),
    [
        (["a.py", "--seed", "5"], None, "a.py", ["--seed", "5"]),
        (["--step-on", "/t", "a.py", "x"], ["/t"], "a.py", ["x"]),
        (["--step-on", "/t", "/s", "a.py", "--step-on"], ["/t", "/s"], "a.py", ["--step-on"]),
        (["--step-on", "none", "--seed", "3", "a.py"], ["none"], "a.py", []),
        (["--record", "run.bag", "--step-on", "/t", "a.py", "x"], ["/t"], "a.py", ["x"]),
        (["--step-on", "/t", "--step-on", "/s", "--dt", "0.002", "a.py"], ["/t", "/s"], "a.py", []),
        (["--step-on=/t", "a.py", "__name:=x"], ["/t"], "a.py", ["__name:=x"]),
        (["--", "a.py", "--dt"], None, "a.py", ["--dt"]),
    ],
)
def test_options_end_where_the_script_begins(given, triggers, script, arguments):
    args = _parse(given)
    assert (args.step_on, args.script, args.arguments) == (triggers, script, arguments)


@pytest.mark.parametrize(
    "given",
    [[], ["--seed", "-1", "a.py"], ["--seed", "x", "a.py"], ["--dt", "0", "a.py"], ["--dt", "nan", "a.py"],
     ["--dt", "inf", "a.py"], ["--step-on", "--seed", "1", "a.py"], ["--nonsense", "a.py"],
     ["--record", "/none/run.bag", "a.py"], ["--record", "/tmp", "a.py"],
     ["--dt", "x", "a.py"], ["--dt", "1e9", "a.py"], ["--seed", "1.5", "a.py"],
     ["--step-on", "none", "/tick", "--seed", "1", "a.py"]],
)  # fmt: skip
def test_what_makes_no_sense_is_refused(given, capsys):
    with pytest.raises(SystemExit) as ended:
        _parse(given)
    assert ended.value.code == 2
    assert "lockstep.py: error:" in capsys.readouterr().err


def test_seeds_reach_every_generator(monkeypatch):
    import random
    import secrets

    import numpy
    import torch
    from gymnasium.utils.seeding import np_random

    def drawn():
        generators = (random, numpy.random, numpy.random.default_rng(), np_random()[0])
        return [*(each.random() for each in generators), torch.rand(1).item()]

    monkeypatch.setattr(numpy.random.bit_generator, "randbits", secrets.randbits)
    states = random.getstate(), numpy.random.get_state(), torch.get_rng_state()
    try:
        seed_everything(5)
        one = drawn()
        seed_everything(5)
        assert drawn() == one
        seed_everything(6)
        assert drawn() != one
    finally:
        random.setstate(states[0])
        numpy.random.set_state(states[1])
        torch.set_rng_state(states[2])


def test_what_is_imported_later_is_seen_to_once(tmp_path, monkeypatch):
    (tmp_path / "imported_later.py").write_text("value = 1\n")
    monkeypatch.syspath_prepend(tmp_path)
    seen = []
    finder = AfterImport("imported_later", seen.append)
    monkeypatch.setattr(sys, "meta_path", [finder, *sys.meta_path])
    import imported_later

    assert seen == [imported_later]
    sys.modules.pop("imported_later")
    import imported_later as again

    assert again is not imported_later and len(seen) == 1
    sys.modules.pop("imported_later")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("line", "loaded"),
    [
        ("import os, sys, time, rospy; rospy.sleep(0.01)", set()),
        ("from concurrent import futures", {"looks", "python_locks", "python_threads"}),
        ("import subprocess; subprocess.run(['true'])", {"followers", "line", "looks"}),
    ],
)
def test_what_simulates_threads_and_processes_is_loaded_for_scripts_that_use_them(
    root, tmp_path, line, loaded
):
    script = tmp_path / "script.py"
    script.write_text(
        f"{line}\nimport sys\n"
        "print(*[name for name in sys.modules if name.startswith('lockstep_runner.concurrency.')])\n"
    )
    environment = os.environ | {"ROS_MASTER_URI": "http://127.0.0.1:1"}
    done = run([sys.executable, root / "scripts/lockstep.py", script], check=True, env=environment)
    assert {name.rpartition(".")[2] for name in done.stdout.split()} == loaded

"""The bags of lockstep.py --record."""

from lockstep_runner.recording import recorded


def test_all_bags_of_an_earlier_recording_go_and_no_other_file(tmp_path, monkeypatch):
    """What a second simulator wrote then would be taken for part of the new recording."""
    monkeypatch.setenv("ROS_MASTER_URI", "http://127.0.0.1:9")
    older = ("run[a].bag", "run[a].bag.active", "run[a].2.bag", "run[a].3.bag.active")
    others = (
        "run[a]_2.bag", "run[a].x.bag", "runa.2.bag", "other.bag", "run[a].2.bag.gz",
        "run[a].1.bag", "run[a].007.bag", "run[a].20261126.bag",
    )  # fmt: skip
    for name in (*older, *others):
        (tmp_path / name).touch()
    with recorded(str(tmp_path / "run[a].bag")):
        assert {path.name for path in tmp_path.iterdir()} == set(others)

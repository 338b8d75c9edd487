"""Populations of world files: how many models, under which names, and where."""

import math
import re

import pytest
from support.robots.snippets import ball, collision, sdf_link, sdf_world
from support.robots.worlds import run

from robot_sim.physics.description import LimitExceeded
from robot_sim.physics.files import reading
from robot_sim.physics.files.reading import Resources
from robot_sim.physics.files.world_file import fill, load_world, parse_world
from robot_sim.physics.world import World

BALL = sdf_link("l", more=collision(ball(0.1)), moment=1.0)
CAN = f'<model name="can"><pose>9 9 9 0 0 1.5</pose>{BALL}</model>'
GONE = '<model name="m"><include><uri>model://gone</uri></include></model>'
BOX = "<box><size>4 2 1</size></box>"
DISC = "<cylinder><radius>2</radius><length>1</length></cylinder>"


def population(kind, region="", count=10, name="cans", model=CAN, pose="10 20 30 0 0 0"):
    return (
        f'<population name="{name}">{model}<pose>{pose}</pose>{region}<model_count>{count}</model_count>'
        f"<distribution>{kind}</distribution></population>"
    )


def world(*parts):
    return parse_world(sdf_world(*parts), Resources())


def places(kind, *given, **more):
    found = world(population(kind, *given, **more))
    assert found.warnings == []
    middle = (10.0, 20.0, 30.0)
    return [
        tuple(round(a - b, 9) for a, b in zip(each.initial_pose.position, middle, strict=True))
        for each in found.models.values()
    ]


def test_models_are_named_and_turned_as_in_gazebo():
    found = world(population("<type>random</type>", BOX, 3), CAN)
    assert list(found.models) == ["can", "can_clone_0", "can_clone_1", "can_clone_2"]
    turned = found.models["can"].initial_pose.orientation
    assert found.models["can_clone_2"].initial_pose.orientation == pytest.approx(turned)
    assert found.models["can_clone_0"] is not found.models["can_clone_1"]


@pytest.mark.parametrize("region", [BOX, DISC])
def test_a_random_population_fills_its_region_alike_each_time(region):
    found = places("<type>random</type>", region, 300)
    assert found == places("<type>random</type>", region, 300)
    assert found != places("<type>random</type>", region, 300, name="others")
    for axis, half in enumerate((2.0, 1.0 if region is BOX else 2.0, 0.5)):
        values = [each[axis] for each in found]
        assert max(map(abs, values)) <= half
        assert max(values) > 0.9 * half
        assert min(values) < -0.9 * half
        assert abs(sum(values)) / 300 < 0.2 * half
    if region is DISC:
        assert max(math.hypot(x, y) for x, y, _ in found) <= 2.0
        assert 100 < sum(math.hypot(x, y) < math.sqrt(2.0) for x, y, _ in found) < 200


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_a_linear_population_is_a_row(axis):
    row = places(f"<type>linear-{'xyz'[axis]}</type>", BOX, 4)
    size = (4.0, 2.0, 1.0)[axis]
    assert [each[axis] for each in row] == [-size / 2, -size / 4, 0.0, size / 4]
    assert all(each[other] == 0.0 for each in row for other in {0, 1, 2} - {axis})
    if axis == 0:  # the region is turned with its pose
        (first, *_) = places("<type>linear-x</type>", BOX, 2, pose="10 20 30 0 0 1.570796326794897")
        assert first == pytest.approx((0.0, -2.0, 0.0))


def test_a_grid_has_rows_and_columns_instead_of_a_count():
    grid = "<type>grid</type><rows>2</rows><cols>3</cols><step>0.5 1 0</step>"
    rows = [[(x, y, 0.0) for x in (-0.5, 0.0, 0.5)] for y in (-0.5, 0.5)]
    assert places(grid) == [*rows[0], *rows[1]]


def test_a_uniform_population_has_its_count():
    grid = [(x, y, 0.0) for y in (-0.5, 0.5) for x in (-1.5, -0.5, 0.5, 1.5)]
    assert places("<type>uniform</type>", BOX, 8) == grid
    disc = places("<type>uniform</type>", DISC, 50)
    assert len(disc) == 50
    assert max(math.hypot(x, y) for x, y, _ in disc) < 2.0
    nearest = [min(math.dist(a, b) for b in disc if b is not a) for a in disc]
    assert min(nearest) > 0.3
    thin = "<box><size>1e200 1e-200 1</size></box>"
    assert len(world(population("<type>uniform</type>", thin, 3)).models) == 3


def test_a_population_of_an_included_model_in_a_file(tmp_path, new_engine):
    (tmp_path / "can").mkdir()
    (tmp_path / "can/model.config").write_text('<model><sdf version="1.6">model.sdf</sdf></model>')
    (tmp_path / "can/model.sdf").write_text(f'<sdf version="1.6">{CAN}</sdf>')
    model = '<model name="c"><include><static>1</static><uri>model://can</uri></include></model>'
    path = tmp_path / "it.world"
    one = population("<type>random</type>", BOX, 5, model=model, pose="0 0 3 0 0 0")
    two = population("<type>grid</type><rows>2</rows><cols>2</cols>", model=CAN, pose="0 9 1 0 0 0")
    path.write_text(sdf_world(one, two))
    found = load_world(path, Resources(models=(tmp_path,)))
    there = World(new_engine())
    assert [error for _, error in fill(there, found.models)] == [None] * 9
    run(there, 500)
    heights = {name: model.state()[0].position[2] for name, model in there.models.items()}
    assert all(heights[f"can_clone_{i}"] < 0.5 for i in range(4))
    assert list(heights)[:5] == [f"c_clone_{i}" for i in range(5)]


@pytest.mark.parametrize(
    ("given", "fault"),
    [(population("<type>spiral</type>", BOX), "<type>: 'spiral' is no distribution"),
     (population("<type>random</type>"), "it has neither a <box> nor a <cylinder>"),
     (population("<type>random</type>", "<box><size>0 1 1</size></box>"), "sizes must be above 0"),
     (population("<type>random</type>", BOX, 0), "<model_count> is 0, so it has no models"),
     (population("<type>grid</type><rows>-1</rows>"), "<distribution/rows> is -1, so it has no models"),
     (population("<type>random</type>", BOX, model=""), "it has no <model>"),
     (population("<type>random</type>", BOX, "many"), "'many'"),
     (population("<type>random</type>", BOX, model=GONE), "model 'm_clone_0': <include> of 'model://gone'")],
)  # fmt: skip
def test_a_population_with_a_fault_is_left_out_with_one_line(given, fault):
    found = world(given, CAN)
    assert list(found.models) == ["can"]
    (warning,) = found.warnings
    assert re.fullmatch(f"population 'cans': .*{re.escape(fault)}.*; it is left out", warning)


def test_a_population_beyond_all_bounds_is_refused_before_it_is_made(monkeypatch):
    monkeypatch.setattr(reading, "MAX_MODELS", 100)
    with pytest.raises(LimitExceeded, match="MAX_MODELS"):
        world(population("<type>random</type>", BOX, 10**12))

"""What becomes of a link's figures, and what a variation is beside the nominal robot."""

from robot_envs.variation import LinkFigures, LinkScale, Variation

ROD = LinkFigures(2.0, (0.0, 0.0, 0.5), 1.0, 0.0, 0.0, 1.0, 0.0, 0.1)


def test_figures_of_a_varied_rod():
    varied = ROD.scaled(LinkScale(mass=2.0, length=3.0))
    assert varied == LinkFigures(4.0, (0.0, 0.0, 1.5), 18.0, 0.0, 0.0, 18.0, 0.0, 0.2)
    assert ROD.scaled(LinkScale(mass=0.5)).tensor["ixx"] == 0.5
    assert ROD.scaled(LinkScale()) == ROD


def test_a_variation_that_changes_nothing_is_nominal_and_so_is_one_undone():
    assert Variation().is_nominal
    for variation in (
        Variation({"rod": LinkScale(1.1)}),
        Variation({"rod": LinkScale(length=0.9)}),
        Variation(friction={"hinge": 0.1}),
    ):
        assert not variation.is_nominal
        assert variation.undone.is_nominal
        assert variation.undone.links.keys() == variation.links.keys()
        assert variation.undone.friction.keys() == variation.friction.keys()

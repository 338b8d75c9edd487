"""The noise of a world's sensors is its seed's."""

from types import SimpleNamespace

from robot_sim.sensors.sensing import Sensing

MODEL = SimpleNamespace(name="bot")


def draws(sensing, key="base::eye", now=5):
    return sensing.noise(MODEL, key, now).normal(size=3).tolist()


def test_noise_is_that_of_seed_sensor_and_time(sim):
    first, other = Sensing(sim, 1), Sensing(sim, 2)
    assert draws(first) == draws(Sensing(sim, 1)) == draws(first)
    assert draws(first) != draws(other)
    assert draws(first) != draws(first, "base::ear") and draws(first) != draws(first, now=6)


def test_resets_draw_other_noise_and_a_seed_the_same_again(sim):
    sensing = Sensing(sim, 1)
    sim.reseed(7)
    before = draws(sensing)
    sim.reset_simulation()
    assert draws(sensing) != before
    sim.reseed(7)
    assert draws(sensing) == before

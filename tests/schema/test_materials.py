"""A material that a terrain and a rover share has one density."""

import numpy as np
import pytest

from rille import store
from rille.model import InputRefused, MassProperties, Material, Part, Rover
from rille.store.database import writing
from rille.store.rover import write_material


def density(path):
    """The density of the only material [kg/m^3]."""
    with writing(path) as connection:
        return connection.execute("SELECT density FROM material").fetchone()["density"]


def put(path, value):
    with writing(path) as connection:
        write_material(connection, Material(name="basalt", density=value))


def test_a_material_of_which_nothing_is_made_may_change(tmp_path):
    path = tmp_path / "m.db"
    store.create(path)
    put(path, 2500.0)
    put(path, 2900.0)
    assert density(path) == 2900.0
    with pytest.raises(InputRefused, match="material 'basalt' breaks the rule"):
        put(path, -1.0)
    assert density(path) == 2900.0


def test_a_material_of_which_something_is_made_stays(tmp_path):
    path = tmp_path / "m.db"
    store.create(path)
    whole = MassProperties(mass=1.0, com=np.zeros(3), inertia=np.eye(3), mass_provenance="stated", inertia_provenance="stated")
    part = Part(name="weight", volume=4e-4, properties=whole, material="basalt")
    store.write_rover(path, Rover(materials=(Material(name="basalt", density=2500.0),), parts=(part,)))
    put(path, 2500.0)
    with pytest.raises(InputRefused, match=r"density of 2900 kg/m\^3 here, and 2500 .* the part 'weight' is made of it"):
        put(path, 2900.0)
    assert density(path) == 2500.0

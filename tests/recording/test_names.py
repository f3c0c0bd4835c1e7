"""Does a name mean one thing of a model in whatever order and spelling, and nothing where it contradicts?"""

from itertools import permutations

import pytest

from rille.recording.names import ENDS, SIDES, contradicting, meant, nearest, number_alone

SIDED = [f"{end}_{side}" for side in ("left", "right") for end in ("front", "middle", "rear")]
ROVER = [
    *(f"{kind}_{side}" for kind in ("rocker", "bogie") for side in ("left", "right")),
    *(f"wheel_{place}" for place in SIDED),
    *(f"steering_{place}" for place in SIDED if "middle" not in place),
]
SKID = ["front_left", "rear_left", "front_right", "rear_right"]


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("right rear wheel joint", "wheel_rear_right"),
        ("back_left_wheel", "wheel_rear_left"),
        ("wheel_lf", "wheel_front_left"),
        ("wheelRR", "wheel_rear_right"),
        ("wheel_l_r", "wheel_rear_left"),
        ("LF_drive", "wheel_front_left"),
        ("CR whl", "wheel_middle_right"),
        ("centre-left wheel motor", "wheel_middle_left"),
        ("roue_arrière_gauche", "wheel_rear_left"),
        ("frontleft steer", "steering_front_left"),
        ("drive/steering/aft.rh", "steering_rear_right"),
        ("rover1 left rocker encoder", "rocker_left"),
    ],
)
def test_one_is_meant(name, expected):
    assert meant(name, ROVER) == (expected,)


@pytest.mark.parametrize("name", ROVER)
def test_any_order_and_spelling_means_the_same(name):
    """A place that is said in every way, before or after the kind of thing; never another one."""
    kind, *place = name.split("_")
    spelled = [{**SIDES, **ENDS}[word] for word in place]
    ways = [(one,) for one in spelled[0]] if len(spelled) == 1 else [(a, b) for a in spelled[0] for b in spelled[1]]
    for way in ways:
        for words in permutations([kind, *way]):
            assert meant("_".join(words), ROVER) == (name,), words


@pytest.mark.parametrize(
    ("name", "several"),
    [
        ("rear left motor", ("wheel_rear_left", "steering_rear_left")),
        ("fl", ("wheel_front_left", "steering_front_left")),
        ("wheel_rear", ("wheel_rear_left", "wheel_rear_right")),
        ("rocker", ("rocker_left", "rocker_right")),
    ],
)
def test_what_fits_several_is_ambiguous(name, several):
    assert meant(name, ROVER) == several


@pytest.mark.parametrize(
    "name",
    [
        "imu data",
        "",
        "wheel_left_right_front",
        "front left wheel steering",
        "chassis rocker left",
        "rear bogie 2 flex",
        "wheel 3",
        "mast left",
    ],
)
def test_nothing_is_meant(name):
    assert meant(name, ROVER) == ()


def test_a_wheel_is_no_steering_whatever_it_is_called():
    assert meant("steering front left", SKID, SKID) == ()
    assert meant("FL wheel", SKID, SKID) == ("front_left",)
    assert meant("left wheel", SKID, SKID) == ()
    assert meant("left", SKID, SKID) == ("front_left", "rear_left")


def test_of_several_names_in_one_the_fullest_is_meant():
    assert meant("rotor_shoulder", ["shoulder", "rotor_shoulder"]) == ("rotor_shoulder",)
    assert meant("shoulder", ["rotor_shoulder", "shoulder"]) == ("shoulder",)
    assert meant("chassis imu", ["base", "mast", "hull_link"]) == ("base", "hull_link")
    assert meant("hull imu", ["base", "mast", "hull_link"]) == ("hull_link",)


def test_numbers_tell_names_apart():
    hinges = ["hinge1", "hinge2", "hinge10"]
    assert meant("1", hinges) == ("hinge1",)
    assert meant("hinge 02", hinges) == ("hinge2",)
    assert meant("hinge 3", hinges) == ()
    assert meant("imu 1", ["link1", "link2"]) == ()
    assert contradicting("q 2", "hinge1")
    assert not contradicting("run 3 of hinge 1", "hinge1")
    assert [number_alone(name) for name in ("joint 2", "0", "wheel 2", "1 2", "motor")] == [2, 0, None, None, None]


def test_the_nearest_are_named_first():
    assert nearest("front left wheel steering", ROVER)[:2] == ["wheel_front_left", "steering_front_left"]

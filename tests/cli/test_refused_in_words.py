"""What ended in "this is a bug of rille" ends in a sentence."""

import pytest

from command import assert_refused, rille


@pytest.mark.parametrize(
    ("slips", "sentence"),
    [
        ("0:1:0", "is no list of slips"),
        ("0:inf:0.1", "is no list of slips"),
        ("0:1:1e-7", "1e+07 slips; 10000 are the most"),
        ("a,b", "no list"),
    ],
)
def test_lists_of_slips(slips, sentence):
    assert_refused(rille("bench", "--radius", "0.15", "--width", "0.1", "--slip", slips), sentence)


def test_no_point_is_left_to_fit(tmp_path):
    (tmp_path / "b.csv").write_text("load_N,slip,drawbar_pull_N\n30,0.1,1\n30,0.2,2\n")
    given = ("--soil", "fjs1_simulant", "--radius", "90 mm", "--width", "100 mm", "--fit", "friction_angle", "--only", "slip_ratio>=2")
    assert_refused(rille("soil", "fit", tmp_path / "b.csv", *given), "--only slip_ratio>=2 leaves none of the points")


def test_an_address_that_this_machine_does_not_have(model):
    """It is not the token that is missing, nor another port."""
    assert_refused(rille("serve", model, "--host", "192.0.2.1"), "'192.0.2.1' is no address of this machine")  # RFC 5737: nobody's

"""The points of Ishigami 2005 from one row per number to one row per point, a table for each wheel.

Each quantity was read from its own figure, at its own slips, so that a point has a drawbar pull or a side force, never both.
Usage: python examples/wheel_bench/widen.py [FOLDER]     needs the real data (RILLE_DATA)
"""

import csv
import sys
from pathlib import Path

from rille.model.sheet import data_folder

SOURCE = "data/wheel_bench/tohoku_ishigami2005_single_wheel.csv"
QUANTITIES = ("drawbar_pull_N", "side_force_N", "sinkage_mm")


def main(folder: Path) -> None:
    """Write tohoku_2005_A_smooth.csv and tohoku_2005_B_paddled.csv."""
    folder.mkdir(parents=True, exist_ok=True)
    with (data_folder() / SOURCE).open(newline="") as file:
        rows = list(csv.DictReader(file))
    for wheel in sorted({row["wheel"] for row in rows}):
        path = folder / f"tohoku_2005_{wheel}.csv"
        with path.open("w", newline="") as file:
            table = csv.writer(file)
            table.writerow(["slip", "slip_angle_deg", *QUANTITIES])
            for row in rows:
                if row["wheel"] == wheel:
                    table.writerow(
                        [row["slip"], row["slip_angle_deg"], *(row["value"] if q == row["quantity"] else "" for q in QUANTITIES)]
                    )
        print(path)


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path("out/wheel_bench"))

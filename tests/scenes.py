"""The complete simulated tests beside the project: configuration from their survey."""

import json
from pathlib import Path
from typing import Any

import pytest

SCENES = Path(__file__).parents[2] / "shared" / "scenes"

needs_scenes = pytest.mark.skipif(
    not SCENES.is_dir(), reason="the simulated tests with truth (../shared/scenes) are not here"
)

# As scenes/README.md says: where the leading edge and the suction side point.
SIDES = {"edge": ("-x", "+y"), "flap": ("+y", "+x")}


def configuration(name: str, **paper: Any) -> str:
    """TOML of one scene, written from its survey; `paper` are keys of its table ``[paper]``."""
    folder = SCENES / name
    survey = json.loads((folder / "survey.json").read_text())
    sigma = survey["position_sigma_m"]
    leading_edge, suction_side = SIDES[name]
    parts = [
        f'[test]\nid = "{name}"',
        f"[blade]\nlength_m = {survey['blade_length_m']}\n"
        f'geometry = "{folder}/blade.csv"\ncontours = "{folder}/contours.csv"\n'
        f'leading_edge = "{leading_edge}"\nsuction_side = "{suction_side}"',
        f'[load]\nfile = "{folder}/load.csv"\nvalue = "load_percent"\ndirection = "+x"\n'
        f"saddles_s_m = {survey['loads_s_m']}",
        f'[prediction]\nfile = "{folder}/theory.csv"\nvalue = "deflection_mm_at_100_percent"',
        "[paper]\n" + "\n".join(f"{key} = {value}" for key, value in paper.items()),
    ]
    parts += [_lidar(number, lidar, sigma) for number, lidar in enumerate(survey["lidars"], 1)]
    parts += [
        f'[[control]]\non = "{point["on"]}"\nxyz_m = {point["xyz_m"]}\nu_m = {sigma}'
        for point in survey["control_points"]
    ]
    parts += [f'[[sections]]\nname = "S{s_m}"\ns_m = {s_m}' for s_m in survey["sections_m"]]
    parts += [_wire(wire, folder) for wire in survey["wires"]]
    return "\n\n".join(parts) + "\n"


def _lidar(number: int, lidar: dict[str, Any], sigma: float) -> str:
    axes = ", ".join(f'{axis} = "{to}"' for axis, to in lidar["axes"].items())
    return (
        f'[[lidars]]\nid = "L{number}"\nsource = "{lidar["ip"]}"\n'
        f"position_m = {lidar['position_m']}\nposition_u_m = {sigma}\naxes = {{ {axes} }}"
    )


def _wire(wire: dict[str, Any], folder: Path) -> str:
    return (
        f'[[wires]]\nname = "W{wire["section_m"]}"\nsection = "S{wire["section_m"]}"\n'
        f'anchor_m = {wire["anchor_m"]}\nfile = "{folder}/wire.csv"\n'
        f'column = "{wire["column"]}"'
    )

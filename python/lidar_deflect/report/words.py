"""Every sentence of the report, in one place."""

PAPER = "Hu, Zhu, Zhou, Liu, Optics 2024, 5, 151-164"

HEADINGS = {
    "result": "Result",
    "warnings": "Read before trusting it",
    "key_table": "Deflection at every load step",
    "comparison": "Comparison",
    "curves": "Curves over time",
    "shapes": "Shapes and load",
    "status": "What could not be measured",
    "health": "Lidars and packets",
    "drops": "What was left out",
    "tested": "What was tested, and with what",
    "method": "How it was measured",
    "configuration": "Resolved configuration",
}

KEY_TABLE = (
    "Change of the mid-chord point of each section from the unloaded hold, averaged over the hold. "
    "World frame: z from the root to the tip, y up, x = y cross z."
)
NO_STEPS = "No load step was found; the curves below show every state."
NO_UNCERTAINTY = "This method states no uncertainty."
UNCERTAINTY = "± is the expanded uncertainty of the total (k = 2)."
ERROR = f"Error = (M - T) / T, equation (16) of {PAPER}; null where T is next to nothing."
WIRE = (
    "A draw wire measures along its line. “Along the wire” is what it would have read at the "
    "positions that the lidars measured; “total” is the total deflection, as the paper compares."
)
NOTHING_COMPARED = (
    "Nothing was compared. `lidar-deflect compare RESULTS --reference FILE` adds draw wires, a "
    "prediction, true states or another run."
)

CAPTIONS = {
    "time_series": (
        "Deflection of {section} ({s_m:g} m) over time: x, y, z. Grey: holds. Tinted: no state. "
        "Marks: states that are not ok."
    ),
    "comparison": "Errors by method at the largest deflection.",
    "load_deflection": "Total deflection over load; dots are the averages of the holds.",
    "deflected_shapes": "Line of the blade at every load step: x and y over z.",
    "plan": "The test from above.",
    "health": "Lost packets and points per lidar and second.",
}
LIKE_THE_PAPER = "Like the paper's {figures}."
NO_SCRIPT = "Figures need JavaScript; the tables do not."

STATUS = {
    "ok": "measured",
    "degraded": "measured with fewer lidars or points than in the reference",
    "interpolated": "not measured; between states in time",
    "extrapolated": "beyond the last section that was seen",
    "missing": "no value",
}
REASONS = {
    "overhead": "the blade stood straight above a lidar",
    "lost": "packets were lost",
    "no_points": "no lidar saw the blade",
    "too_few_points": "too few points on the blade",
    "ill_posed": "the geometry does not fix the section",
}
ALL_OK = "Every state of every section was measured."

METHODS = {
    "paper": (
        f"The method of {PAPER}, with its formulas corrected where they are wrong in print.",
        "Each lidar is levelled by the ground plane that it sees (its normal from a singular value "
        "decomposition) and placed at its surveyed position; yaw comes from a surveyed wall, else "
        "from the mounting.",
        "A box about the blade cuts off the surroundings. A density clustering whose radius grows "
        "with distance (equations 9 and 10) takes out noise.",
        "The extremes of each scan line are samples of the leading and the trailing edge; samples "
        "that no line through the others supports are dropped (11 to 13). A curve is fitted to "
        "each edge (14); where the two meet is the tip.",
        "Sections are found by walking back from the tip by the arc length that was measured in "
        "the unloaded state (15). States with the blade above a lidar are filled in time.",
        "The method takes the ground's normal for the vertical, finds the tip by extrapolation, "
        "and states no uncertainty: its numbers are as good as those assumptions.",
    ),
    "beam": (
        "Every echo is a ray that meets the blade's surface; the blade is a beam that keeps its "
        "length. Positions, poses and systematic errors are one adjustment over the unloaded and "
        "the loaded holds, from which every uncertainty follows.",
    ),
}
METHOD_UNKNOWN = "The method {method!r} is described in the documentation of its version."
DEFINITIONS = (
    "Deflection: position of a material section, given by its arc length along the neutral axis, "
    "minus its position in the unloaded hold. Its coordinates are those of the mid-chord point.",
    "Twist change: the turn of the chord about the loaded axis beyond what bending alone would "
    "give; positive turns the trailing edge towards the suction side.",
)

COVER = {
    "customer": "Customer",
    "operator": "Operator",
    "blade_serial": "Blade",
    "standard": "Standard",
    "place": "Place",
    "kind": "Kind of test",
    "notes": "Notes",
}
NOTHING_DROPPED = "Nothing was left out."

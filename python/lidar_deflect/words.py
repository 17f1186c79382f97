"""Every sentence and label of report and figures: a translation is this file in another tongue."""

PAPER = "Hu, Zhu, Zhou, Liu, Optics 2024, 5, 151-164"
LANGUAGE = "en"

KICKER = "Blade deflection by lidar"
SKIP = "Skip to the result"
CONTENTS = "Contents"
NO_SCRIPT = "Figures and replay need JavaScript; every number stands in the tables."
TABLE, FIGURE = "Table", "Figure"
PAGE = "page {page} of {pages}"
UNITS = "World frame: z from the root to the tip, y up, x = y cross z. All times are UTC."

HEADINGS = {
    "result": "Result",
    "tested": "What was tested, and with what",
    "curves": "Curves over time",
    "replay": "The blade in space",
    "load": "Load and deflection",
    "shapes": "Shape, rotation and twist along the span",
    "fatigue": "Cycles",
    "comparison": "Held against wires, prediction and truth",
    "calibration": "Where the lidars stand",
    "health": "Lidars, second by second",
    "checks": "Self-check",
    "method": "Method and uncertainty",
    "left_out": "Warnings, and what was left out",
    "configuration": "Resolved configuration",
    "signatures": "Signatures",
}

# The verdict
VERDICT = {
    "good": "Within ±{limit} of the prediction",
    "bad": "Outside ±{limit} of the prediction",
    "open": "Not decided",
    "none": "No verdict",
}
JUDGED = {
    "within": "within",
    "outside": "outside",
    "open": "not decided",
    "none": "",
}
ALL_WITHIN = "At all {count} load steps and sections that have a prediction."
SOME_OUTSIDE = "At {bad} of {count} load steps and sections; the largest difference is {worst}."
SOME_OPEN = (
    "At {open} of {count} load steps and sections the limit lies inside the expanded uncertainty, "
    "so neither “within” nor “outside” can be claimed; {within} are within."
)
UNJUDGED = "{count} load steps and sections could not be judged: they were not measured."
NOT_UNCERTAIN = (
    "This method states no uncertainty: the measured value itself was judged, as if it were exact."
)
RULE = (
    "A value counts as within or outside only where that holds over its whole expanded uncertainty "
    "(k = 2)."
)
NO_TOLERANCE = (
    "No tolerance was set; none is built in. `prediction.tolerance_percent` in the configuration "
    "sets the user's own."
)
NO_PREDICTION = "Nothing was predicted, so there is nothing to judge by."
NOT_COMPARED = (
    "A prediction is configured, but this folder holds no comparison with it: "
    "`lidar-deflect compare RESULTS --reference FILE`."
)
RESERVED = ", with reservations"
GATES_FAILED = "A quality gate or the self-check failed; see “Self-check” and “Warnings” below."
GATES_PASSED = "Quality gates and self-check passed."

HEADLINES = {
    "deflection": "largest deflection",
    "difference": "largest difference from the prediction",
    "uncertainty": "largest expanded uncertainty of a deflection",
    "states": "of all states measured",
    "lost": "of packets lost",
}

KEY_CAPTION = (
    "Change of the mid-chord point of every section from the unloaded hold, averaged over each "
    "hold. {uncertainty}"
)
KEY_UNCERTAIN = "± is the expanded uncertainty (k = 2, about 95 %)."
KEY_SILENT = "This method states no uncertainty."
KEY_LARGEST = "The step of the largest deflection; every step stands below."
KEY_EVERY = "Every load step and section"
NO_STEPS = "No load step was found; the curves below show every state."
COLUMNS = {
    "step": "step",
    "load": "load",
    "section": "section",
    "s": "s",
    "dx": "dx",
    "dy": "dy",
    "dz": "dz",
    "along": "along load",
    "total": "total",
    "root": "total less root motion",
    "twist": "twist",
    "prediction": "prediction",
    "difference": "difference",
    "verdict": "verdict",
    "points": "points",
    "lidars": "lidars",
    "status": "status",
}
PREDICTED = {
    "total": "Predicted is the total deflection.",
    "direction": "Predicted is the component along the load.",
    "vector": "Predicted is the vector; the difference is the norm of the vector difference.",
}

# What was tested
COVER = {
    "customer": "Customer",
    "operator": "Operator",
    "blade_serial": "Blade",
    "standard": "Standard",
    "place": "Place",
    "kind": "Kind of test",
    "notes": "Notes",
}
COVER_MORE = {
    "length": "Blade length",
    "start": "Start",
    "end": "End",
    "duration": "Duration",
    "sections": "Sections",
    "direction": "Load direction",
    "geometry": "Nominal geometry",
}
LIDARS_CAPTION = (
    "The lidars: what their packets say they are, where they stood, and whose clock counted. "
    "Position is that of the optical centre in the calibration."
)
NEVER_SENT = "Lidar {id} of the configuration never sent a packet."
INPUTS_CAPTION = "Input files by their content: the hash tells any change of a single bit."
SOFTWARE_CAPTION = "Program, libraries and the time each stage took."
NO_INPUTS = "The folder does not say from which files it was made."
ALL_SECTIONS = "{count} sections from {first} m to {last} m"

# Figures: each caption is a sentence that says what is to be seen
CAPTIONS = {
    "time_series": (
        "Deflection of {section} ({s_m:g} m) over time: x, y, z. Grey bands are holds, tinted "
        "stretches have no state, marks are states that are not ok{band}. Zooming one section "
        "zooms all."
    ),
    "replay": (
        "The blade as it was measured. Drag to turn, wheel to zoom, shift-drag to move; arrow keys "
        "turn as well. Dots are echoes, the thick line is the blade, the thin one its unloaded "
        "shape, rings are the sections, squares the lidars, crosses the winch ends of wires."
    ),
    "channels": "Other instruments, on the clock of the lidars.",
    "wires": (
        "Draw wires: the reading, and what the wire would have read at the positions that the "
        "lidars measured. Where only the second stands, the wire is virtual. Below, the "
        "difference."
    ),
    "comparison": (
        "Errors after equation (16) by method at {step}; bars carry the 95 % interval where the "
        "method states one. Like the paper's figure 20."
    ),
    "load_deflection": (
        "Deflection along the load over the load: marks are the holds with their 95 % interval, "
        "dashed the straight line through the holds of rising load, thin the way between them; "
        "a loop between rising and falling load is hysteresis. Below, the distance from that line."
    ),
    "creep": (
        "Drift of {section} along the load in every hold, from the hold's own mean. A slope is "
        "creep, a wave is sway."
    ),
    "deflected_shapes": (
        "Line of the blade at every load step over z: x above, y below. Marks are the sections."
    ),
    "rotation": (
        "Rotation of the sections about x and y, and twist change, along the span at every load "
        "step; bands are 95 % intervals, marks the sections."
    ),
    "plan": (
        "The test from above: sections at every load step, lidars with the 95 % ellipse of their "
        "place (enlarged as the legend says), surveyed points, winch ends of wires."
    ),
    "pose_uncertainty": (
        "Expanded uncertainty (k = 2) of every lidar's pose: 1 mrad about the blade's axis moves "
        "a deflection of 10 m by 10 mm."
    ),
    "yard_residuals": (
        "What rays of the unloaded hold leave against ground and walls as adjusted, means over "
        "2.5 m. Colour that follows one lidar says that it stands elsewhere; colour that all "
        "lidars share says that the surface is not as it was taken to be."
    ),
    "lidar_shares": "Rays by which every lidar holds ground and walls.",
    "drift": "How far every lidar turned and moved since the calibration.",
    "residuals": (
        "Distance of the blade's echoes from the model along the span. A trend in one lidar alone "
        "says that it stands elsewhere than believed."
    ),
    "residual_map": (
        "Mean distance of the blade's echoes from the model over span and chord: a patch that "
        "stands out in colour is not shaped as the model has it."
    ),
    "section_cut": (
        "Section {section} ({s_m:g} m) across its axis at {step}: surface as adjusted, its "
        " 95 % band, and echoes within 0.3 m along the span."
    ),
    "health": (
        "Every lidar in every second: lost packets, points on the blade, share of the turn whose "
        "packets arrived, and device clock minus UTC."
    ),
    "cycles": "Amplitude of {section} ({s_m:g} m) and frequency over the cycles.",
}
BAND = ", shaded bands 95 % intervals"
MORE_SECTIONS = "{count} more sections"
THINNED = "Long series are thinned for the screen; the extremes stay. The tables keep every state."
NO_REPLAY = "No state has a position, so there is nothing to replay."

# The replay's controls
REPLAY = {
    "play": "Play",
    "pause": "Pause",
    "time": "Time",
    "speed": "Speed",
    "views": "View",
    "iso": "oblique",
    "top": "from above",
    "side": "from the side",
    "end": "from the tip",
    "colour": "Colour by",
    "lidar": "lidar",
    "residual": "residual",
    "alt": "Replay of the blade in space",
    "between": "between holds",
    "step": "step",
}

# Load and deflection
STIFFNESS_CAPTION = (
    "Straight line through the holds of rising load, along the load. Linearity is the largest "
    "distance of a hold from it in percent of the largest deflection; hysteresis is falling minus "
    "rising load where they are farthest apart; residual is what stayed after unloading."
)
STIFFNESS_COLUMNS = {
    "section": "section",
    "s": "s",
    "slope": "slope",
    "linearity": "linearity",
    "hysteresis": "hysteresis",
    "at": "at load",
    "residual": "residual",
}
CREEP_CAPTION = (
    "Drift along the load over each hold, by a straight line; ± is its expanded uncertainty "
    "(k = 2) from the scatter, with sway counted as correlated noise. Drift within it is none."
)
CREEP_COLUMNS = {"duration": "duration", "drift": "drift", "seen": "beyond scatter"}
DRIFTS = {True: "yes", False: "no", None: "too short to tell"}
NO_LOAD = "No load channel was read: the steps were found in the deflection itself."
NO_LOADED = "No loaded hold was measured."

# Comparison
ERROR = (
    f"Error = (M - T) / T, equation (16) of {PAPER}: M is measured, T stands for the truth; "
    "none where T is next to nothing."
)
TABLE2_CAPTION = (
    "As the paper's table 2, at {step}: each method against {against}. ± is the expanded "
    "uncertainty (k = 2) of M, the interval that of the error."
)
EVERY_CAPTION = "Every load step, source and quantity; “in U” is |M - T| over the uncertainty U."
EVERY = "Every step, source and quantity"
WIRE = (
    "A draw wire measures along its line. “Along the wire” is what it would have read at the "
    "positions that the lidars measured; “total” is the total deflection, as the paper compares."
)
VIRTUAL = "virtual: no reading"
NOTHING_COMPARED = (
    "Nothing was compared. `lidar-deflect compare RESULTS --reference FILE` adds draw wires, a "
    "prediction, true states or another run."
)
QUANTITIES = {
    "total": "total",
    "wire": "along the wire",
    "direction": "along the load",
    "dx": "dx",
    "dy": "dy",
    "dz": "dz",
    "twist": "twist",
}
AGAINST_COLUMNS = {
    "section": "section",
    "method": "method",
    "measured": "M",
    "against": "against",
    "reference": "T",
    "off": "M - T",
    "error": "error",
    "interval": "95 % interval of the error",
    "quantity": "quantity",
    "ratio": "in U",
}

# Calibration
CALIBRATED = "Calibrated by “{method}”."
NO_CALIBRATION = "The folder holds no calibration."
EVIDENCE_CAPTION = "What each lidar's pose rests on."
POSES_CAPTION = (
    "Poses with their expanded uncertainty (k = 2): optical centre, and turn about the world's "
    "axes."
)
NO_COVARIANCE = "This calibration states no covariance of its poses."

# Health
HEALTH_CAPTION = "Totals per lidar over the test; duplicated and late packets are not lost."
HEALTH_COLUMNS = {
    "lidar": "lidar",
    "packets": "packets",
    "lost": "lost",
    "lost_percent": "lost",
    "worst": "worst second",
    "duplicated": "duplicated",
    "late": "late",
    "points": "points",
    "blade_points": "on the blade",
    "rpm": "rate",
    "clock": "clock - UTC",
    "coverage": "coverage",
}
NO_HEALTH = "The folder holds no health table."
STATUS_CAPTION = "States that were not measured as they should be, by section and reason."
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
    "stretched": "the sections lie farther apart than the blade is long",
    "before_first_line": "the section lies before the first scan line",
    "few_points": "too few points on the blade",
    "moved": "a lidar's tripod was moved",
    "few_samples": "too few samples of its edges",
    "no_intersection": "the contour curves do not meet",
    "off_the_line": "the samples lie off a common line",
    "beyond_last_line": "the section lies beyond the last scan line",
}
ALL_OK = "Every state of every section was measured."

# Self-check
CHECKS_CAPTION = (
    "Checks of the run on itself, and of this report on the tables. A blade keeps its length and a "
    "sum its terms, whatever the lidars say."
)
CHECKS_COLUMNS = {"check": "check", "found": "found", "limit": "limit", "result": "result"}
PASSED, FAILED, UNKNOWN, WARNS = "passed", "failed", "not judged", "look at it"
CHECKS = {
    "hashes": "All tables come from one configuration",
    "totals": "Totals are the norms of their components",
    "length": "No two neighbouring sections are farther apart than the blade between them",
    "reference": "The unloaded hold deflects by nothing",
    "monotone": "Rotation grows outward of the last saddle",
    "gates": "Quality gates of the run",
}
LENGTH_WHY = (
    "The mid-chord line may stretch where its axis may not, so {limit} of the blade's length is "
    "allowed."
)

# Method
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
        "Observations are ranges along known rays and the intervals in which an edge lies, not "
        "points: where a ray meets the model, its measured and its modelled range are compared.",
        "The state is the rotation of the sections along the span, bent as load and nominal "
        "stiffness say, with corrections; integrated, it gives positions whose arc length cannot "
        "change. Sway within a hold belongs to the state.",
        "What is not known exactly is estimated along with it, under a prior: poses with the "
        "registration's covariance, range offsets per channel and unit, chord scale, setting "
        "angle, edge bias, waves of the built surface.",
    ),
}
METHOD_UNKNOWN = "The method “{method}” is described in the documentation of its version."
DEFINITIONS = (
    "Deflection: position of a material section, given by its arc length along the neutral axis, "
    "minus its position in the unloaded hold. Its coordinates are those of the mid-chord point.",
    "Twist change: the turn of the chord about the loaded axis beyond what bending alone would "
    "give; positive turns the trailing edge towards the suction side.",
)
BUDGET_HEADING = "What the uncertainty is made of"
BUDGET = {
    "beam": (
        "Noise of the ranges: independent between echoes, averages out over thousands of them.",
        "Range offsets per channel and unit: shared by all echoes of a channel; cancel between "
        "unloaded and loaded state as far as the same channels see the same part of the blade.",
        "Poses of the lidars: shared by everything. The common turn about the blade's axis is "
        "seen by ground and wall alone; it moves a deflection d by the angle times d.",
        "Geometry and stiffness of the blade as drawn: decide the inner span that no lidar sees, "
        "and through it the position along z.",
        "Edges: the beam's width lets an edge appear outside of the silhouette; the part that "
        "changes between holds does not cancel.",
        "The uncertainty of a hold's average is that of its states: what they share does not "
        "average out.",
    ),
    "paper": (
        "Not stated by the method, and not made up here. Known contributions: the slope of the "
        "ground (17 mm per 0.1 degree and 10 m of deflection), the extrapolated tip (metres "
        "where the contour curves are nearly parallel), the edge bias of half a step and half a "
        "beam, which changes with range and viewing angle, and the motion of the root.",
    ),
}
BUDGET_TERMS = {
    "range_noise": "noise of single ranges",
    "edge_steps": "step between shots at the edges",
    "registration": "registration of the lidars",
    "range_offsets": "range offsets, scale and elevation of the lidars",
    "edge_angle": "angle by which edges lie outside of the silhouette",
    "surface": "surface as built against its drawing",
    "stiffness": "stiffness of the blade",
    "weight_and_prebend": "weight and prebend",
    "loads": "where and how the load enters",
    "root": "rotation of the root",
    "sway": "sway within the hold",
    "clocks": "clocks of the lidars against each other",
    "reference": "the unloaded state that the deflection counts from",
    "moment": "noise of this moment alone",
}
BUDGET_STEP_CAPTION = (
    "Contributions to the expanded uncertainty (k = 2) of the total deflection at {step}, "
    "millimetres; the root of the sum of their squares is the whole."
)
BUDGET_CAPTION = "Contributions to the expanded uncertainty (k = 2), as the run states them."
NOT_CLAIMED = (
    "Not covered by any number here: a blade that differs from its drawing by more than the priors "
    "say, a root or stand that moves unmeasured, survey marks that moved, air that refracts, and "
    "the traceability of the lidars' range to a standard of length, which this program cannot give."
)
EVIDENCE = "What the method decided on the way"

# Warnings and drops
NO_WARNINGS = "The run gave no warning and passed its gates."
DROPS_CAPTION = "Everything that arrived and did not count, by reason."
NOTHING_DROPPED = "Nothing was left out."
DROPS_PLACES = {"capture": "capture", "run": "run", "blade": "near the blade"}
SHIFTED = "Clocks of other instruments"

SHEET_THINNED = "Every {every}. of {rows} rows stands in this workbook; the Parquet file holds all."

NO_FONT = (
    "no font of this machine has {characters}; they show as a replacement sign. Chinese needs a "
    "font package such as fonts-noto-cjk"
)
TOO_LONG = "Too long for paper; the HTML report and the tables hold it."
ON_SCREEN = "Figure {number}, the replay of the blade in space, moves only in the HTML report."

CONFIGURATION = "The configuration with every default, as the run used it; its hash is {hash}."
NO_CONFIGURATION = "The folder holds no configuration."

SIGNATURES = ("Tested by", "Checked by", "Approved by")
SIGNATURE_FIELDS = ("Name", "Date", "Signature")
MADE = "Made by lidar-deflect {version} from {folder}."

# Two runs
TWO_RUNS = "Two runs compared"
TWO_RUNS_KICKER = "Difference of two runs"
TWO_RUNS_CAPTION = (
    "{first} minus {second}, step by step. ± is the expanded uncertainty (k = 2) of the "
    "difference, the two runs taken as independent: what they share (survey, units, drawing) makes "
    "the true one smaller. “beyond U” marks differences that their uncertainty does not explain."
)
TWO_RUNS_FIGURE = "Difference of the total deflection by section; bars are 95 % intervals."
TWO_RUNS_SETTINGS = "What was set differently"
TWO_RUNS_SAME = "All {count} differences are explained by their uncertainty"
TWO_RUNS_DIFFER = "{beyond} of {count} differences are beyond their uncertainty"
TWO_RUNS_SILENT = "No verdict: a run states no uncertainty"
TWO_RUNS_CHANCE = "Of independent differences about one in twenty is beyond its U by chance."
TWO_RUNS_LARGEST = "largest difference of the total deflection"
KEY = "key"
SAME_SETTINGS = "Both runs have the same configuration."
BEYOND = {"good": "explained", "bad": "beyond U", "open": "no uncertainty"}

# Labels of the figures, by what they say in English
PLOT = {
    "95": "95 %",
    "about_x": "about x (°)",
    "about_y": "about y (°)",
    "along_the_load_from_the_hold_s_mea": "along the load, from the hold's mean (mm)",
    "amplitude": "amplitude (m)",
    "arc_length_s": "arc length s (m)",
    "blade_points": "blade points (1/s)",
    "by_the_lidars": "by the lidars",
    "clock_utc": "clock - UTC (ms)",
    "coverage": "coverage (%)",
    "cycle": "cycle",
    "deflection_along_the_load": "deflection along the load (m)",
    "difference": "difference",
    "error": "error (%)",
    "frequency": "frequency (Hz)",
    "frequency_2": "frequency",
    "from_the_line": "from the line (mm)",
    "lidar": "lidar",
    "lidar_wire": "lidar - wire (mm)",
    "load": "load (%)",
    "lost": "lost (%)",
    "measured_model": "measured - model (mm)",
    "missing": "missing",
    "no_outline": "this method gives no outline of this section",
    "along_the_chord": "along the chord (m)",
    "across_the_chord": "across (m)",
    "band": "95 % band",
    "surface": "surface",
    "chord_suction": "chord, suction side",
    "chord_pressure": "chord, pressure side",
    "no_cycles_were_found": "no cycles were found",
    "no_draw_wire_real_or_virtual_is_in": "no draw wire, real or virtual, is in the tables",
    "no_health_was_written": "no health was written",
    "no_hold_was_measured": "no hold was measured",
    "no_load_channel_was_read": "no load channel was read",
    "no_load_step_was_measured": "no load step was measured",
    "no_other_channel_was_read": "no other channel was read",
    "no_pose_was_watched": "no pose was watched",
    "nothing_has_a_place": "nothing has a place",
    "ellipse_enlarged": "95 % ellipse, {times} times as large",
    "no_residuals_of_the_yard": "this calibration keeps no residuals of the yard",
    "rays": "rays",
    "nothing_was_compared": "nothing was compared",
    "points": "points (1/s)",
    "reading": "reading",
    "section": "section",
    "shift": "shift (mm)",
    "shift_along_x": "shift along x",
    "shift_along_y": "shift along y",
    "shift_along_z": "shift along z",
    "shift_k_2": "shift, k = 2 (mm)",
    "surveyed_point": "surveyed point",
    "this_calibration_states_no_covaria": "this calibration states no covariance",
    "this_method_gives_no_rotations_alo": "this method gives no rotations along the span",
    "this_method_keeps_no_residuals": "this method keeps no residuals",
    "time": "time (s)",
    "time_in_the_hold": "time in the hold (s)",
    "turn": "turn (mrad)",
    "turn_about_x": "turn about x",
    "turn_about_y": "turn about y",
    "turn_about_z": "turn about z",
    "turn_k_2": "turn, k = 2 (mrad)",
    "turns": "turns (1/min)",
    "twist": "twist (°)",
    "wire": "wire",
    "wire_anchor": "wire anchor",
    "x": "x (m)",
    "y": "y (m)",
    "z": "z (m)",
    "z_along_the_blade": "z, along the blade (m)",
}

# Heads of the tables that tell of lidars, files and states
HEADS = {
    "lidar": "lidar",
    "model": "model",
    "source": "source",
    "returns": "returns",
    "rate": "rate",
    "clock": "clock",
    "beams": "beams",
    "input": "input",
    "size": "size",
    "what": "what",
    "value": "value",
    "section": "section",
    "status": "status",
    "meaning": "meaning",
    "reason": "reason",
    "states": "states",
    "share": "share",
    "where": "where",
    "count": "count",
    "turn": "U turn",
}

"""Which anatomical site each marker of the common sets means: marker name -> site or joint, or a place of its own.

Markers of clusters (thigh, shank) are stuck anywhere; theirs are where recordings with these names have them. Where
other laboratories use the same names, or for wands and plates, they say little until they are found on this person.
"""

from __future__ import annotations

from .aliases import OTHERS
from .anatomy import ANYWHERE, RADIUS, Place, foot, shank, thigh

Meaning = str | tuple[str, Place, float]  # the name of a site or joint; or a side, a place on it, and its spread, m


def _both(names: dict[str, str], *, left: str, right: str) -> dict[str, Meaning]:
    """Markers of both sides, whose names begin with `left` and `right`."""
    sides = {"left": left, "right": right}
    return {prefix + name: f"{side}_{site}" for name, site in names.items() for side, prefix in sides.items()}


# OpenSim's gait2354 and gait2392.
OPENSIM_GAIT: dict[str, Meaning] = {
    "Top.Head": "head_top",
    "Sternum": "sternum",
    "V.Sacral": "sacrum",
    **_both(
        {
            "Temple": "temple",
            "Acromium": "acromion",
            "Bicep": "biceps",
            "Elbow": "elbow_lateral",
            "Wrist.Med": "radius",
            "Wrist.Lat": "ulna",
            "ASIS": "asis",
            "Knee.Lat": "knee_lateral",
            "Knee.Med": "knee_medial",
            "Ankle.Lat": "malleolus_lateral",
            "Ankle.Med": "malleolus_medial",
            "Heel": "heel_marker",
            "Midfoot.Sup": "midfoot_medial",
            "Midfoot.Lat": "midfoot_lateral",
            "Toe.Tip": "toe_tip",
            "Toe.Lat": "metatarsal_5",
            "Toe.Med": "metatarsal_1",
        },
        left="L.",
        right="R.",
    ),
    "L.Thigh.Upper": ("left", thigh(0.47, 0.9, 0.2), RADIUS),
    "L.Thigh.Front": ("left", thigh(0.56, 0.2, 1), RADIUS),
    "L.Thigh.Rear": ("left", thigh(0.71, 1, 0.1), RADIUS),
    "L.Shank.Upper": ("left", shank(0.19, 1, -0.2), RADIUS),
    "L.Shank.Front": ("left", shank(0.31, 0.4, 0.8), RADIUS),
    "L.Shank.Rear": ("left", shank(0.29, 0.9, -0.4), RADIUS),
    "R.Thigh.Upper": ("right", thigh(0.52, 0.9, 0.5), RADIUS),
    "R.Thigh.Front": ("right", thigh(0.66, -0.1, 1), RADIUS),
    "R.Thigh.Rear": ("right", thigh(0.79, 0.9, 0.5), RADIUS),
    "R.Shank.Upper": ("right", shank(0.18, 0.9, -0.4), RADIUS),
    "R.Shank.Front": ("right", shank(0.26, 0.2, 1), RADIUS),
    "R.Shank.Rear": ("right", shank(0.38, 1, -0.1), RADIUS),
}

# The set of OpenCap's and the LaiArnold model's validation recordings.
OPENCAP: dict[str, Meaning] = {
    "C7": "c7",
    **_both(
        {
            "Shoulder": "acromion",
            "Sternum": "sternoclavicular",
            "humerus": "upper_arm",
            "elbow_lat": "elbow_lateral",
            "elbow_med": "elbow_medial",
            "forearm": "forearm",
            "wrist_radius": "radius",
            "wrist_ulna": "ulna",
            "HJC": "hip_centre",
            "HJC_reg": "hip_centre",
        },
        left="L_",
        right="R_",
    ),
    **_both({"ASIS": "asis", "PSIS": "psis"}, left="L.", right="r."),
    **_both(
        {
            "knee": "knee_lateral",
            "mknee": "knee_medial",
            "ankle": "malleolus_lateral",
            "mankle": "malleolus_medial",
            "calc": "heel_marker",
            "toe": "metatarsal_2",
            "5meta": "metatarsal_5",
        },
        left="L_",
        right="r_",
    ),
    "L_thigh1": ("left", thigh(0.34, 0.7, 0.7), RADIUS),
    "L_thigh2": ("left", thigh(0.7, 0.5, 0.9), RADIUS),
    "L_thigh3": ("left", thigh(0.37, 1, -0.2), RADIUS),
    "L_thigh4": ("left", thigh(0.71, 1, -0.2), RADIUS),
    "L_shank_antsup": ("left", shank(0.19, 0.7, 0.6), RADIUS),
    "L_sh2": ("left", shank(0.16, 0.9, -0.4), RADIUS),
    "L_sh3": ("left", shank(0.47, 0.9, -0.4), RADIUS),
    "r_thigh1": ("right", thigh(0.26, 0.7, 0.6), RADIUS),
    "r_thigh2": ("right", thigh(0.54, 0.7, 0.7), RADIUS),
    "r_thigh3": ("right", thigh(0.62, 1, 0.2), RADIUS),
    "r_thigh4": ("right", thigh(0.29, 0.9, -0.5), RADIUS),
    "r_thigh5": ("right", thigh(0.58, 0.9, -0.4), RADIUS),
    "r_shank_antsup": ("right", shank(0.2, 0.7, 0.6), RADIUS),
    "r_sh2": ("right", shank(0.49, 0.7, 0.7), RADIUS),
    "r_sh3": ("right", shank(0.21, 1, -0.2), RADIUS),
    "r_sh4": ("right", shank(0.51, 1, -0.2), RADIUS),
}

# Vicon's Plug-in Gait and its relatives, with joint centres (HJC, KJC, AJC).
PLUG_IN_GAIT: dict[str, Meaning] = {
    "C7": "c7",
    "T10": "t10",
    "CLAV": "clavicle",
    "STRN": "lower_sternum",
    "SACR": "sacrum",
    "RBAK": "right_scapula",
    **_both(
        {
            "FHD": "forehead",
            "BHD": "occiput",
            "SHO": "acromion",
            "UPA": "upper_arm",
            "ELB": "elbow_lateral",
            "FRM": "forearm",
            "FRA": "forearm",
            "WRA": "radius",
            "WRB": "ulna",
            "FIN": "hand_back",
            "ASI": "asis",
            "PSI": "psis",
            "THI": "thigh",
            "TIB": "shank",
            "KNE": "knee_lateral",
            "LFC": "knee_lateral",
            "MFC": "knee_medial",
            "ANK": "malleolus_lateral",
            "LMAL": "malleolus_lateral",
            "MMAL": "malleolus_medial",
            "HEE": "heel_marker",
            "CAL": "heel_marker",
            "TOE": "metatarsal_2",
            "MT1": "metatarsal_1",
            "MT5": "metatarsal_5",
            "HJC": "hip_centre",
            "KJC": "knee",
            "AJC": "ankle",
        },
        left="L",
        right="R",
    ),
    # In the recordings seen, MT2 is on the foot's outer edge.
    **{f"{side[0].upper()}MT2": (side, foot(0.85, 1, 0, 0), RADIUS) for side in ("left", "right")},
    "LTH1": ("left", thigh(0.21, 1, -0.2), ANYWHERE),
    "LTH2": ("left", thigh(0.44, 0.3, 0.9), ANYWHERE),
    "LTH3": ("left", thigh(0.66, 0.9, -0.3), ANYWHERE),
    "RTH1": ("right", thigh(0.13, 1, 0.1), ANYWHERE),
    "RTH2": ("right", thigh(0.36, 0, 1), ANYWHERE),
    "RTH3": ("right", thigh(0.57, 1, 0.1), ANYWHERE),
    "LTB1": ("left", shank(0.25, -0.8, 0.5), ANYWHERE),
    "LTB2": ("left", shank(0.48, 0.9, -0.4), ANYWHERE),
    "LTB3": ("left", shank(0.72, -1, 0.1), ANYWHERE),
    "RTB1": ("right", shank(0.23, -0.9, 0.3), ANYWHERE),
    "RTB2": ("right", shank(0.47, 0.9, -0.3), ANYWHERE),
    "RTB3": ("right", shank(0.7, -0.9, 0.3), ANYWHERE),
}

# What two sets call by one name is what the last of these calls so.
MARKERS: dict[str, Meaning] = {**OTHERS, **PLUG_IN_GAIT, **OPENCAP, **OPENSIM_GAIT}

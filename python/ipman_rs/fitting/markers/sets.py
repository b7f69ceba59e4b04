"""Which anatomical site each marker of the common sets means: marker name -> site or joint, or a place of its own.

Markers of clusters (thigh, shank) are stuck anywhere; theirs are where recordings with these names have them. Where
other laboratories use the same names, or for wands and plates, they say little until they are found on this person.
"""

from __future__ import annotations

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


def _aliases(names: dict[str, str]) -> dict[str, Meaning]:
    """Sites by the words that other sets call them, without their sides: markers of both sides."""
    return {
        f"{prefix}.{word}": f"{side}_{site}"
        for site, words in names.items()
        for word in words.split()
        for side, prefix in {"left": "L", "right": "R"}.items()
    }


# The same places by the names of other sets: Rajagopal's and Camargo's models, the ISB's recommendations, Dumas's, the
# Istituto Ortopedico Rizzoli's, Cleveland Clinic's, CAST, BMClab's data sets, Qualisys' sets for sports and CAST,
# the Oxford foot model.
OTHERS: dict[str, Meaning] = {
    **_aliases(
        {
            "asis": "ASI ASIS IAS SIAS ASISI Waist.Front",
            "psis": "PSI PSIS IPS SIPS Waist.Back",
            "iliac_crest": "Iliac.Crest ICrest Crest ILC ICR ICT Iliac",
            "trochanter": "GTR GT TROC TROCH Trochanter GTROC Greater.Trochanter FTC TRO",
            "hip_centre": "HJC Hip.Joint HipJC Hip.Joint.Centre Hip.Joint.Center HipCenter HipCentre",
            "knee": "KJC Knee.Joint KneeJC Knee.Joint.Centre Knee.Joint.Center KneeCenter KneeCentre",
            "ankle": "AJC Ankle.Joint AnkleJC Ankle.Joint.Centre Ankle.Joint.Center AnkleCenter AnkleCentre",
            "shoulder": "SJC Shoulder.Joint ShoulderJC Shoulder.Joint.Centre Shoulder.Joint.Center GHJC",
            "elbow": "EJC Elbow.Joint ElbowJC Elbow.Joint.Centre Elbow.Joint.Center",
            "wrist": "WJC Wrist.Joint WristJC Wrist.Joint.Centre Wrist.Joint.Center",
            "knee_lateral": "Knee KNE KneeLat Lat.Knee Lateral.Knee Knee.Lateral KneeOut KneeExt KNEOut KNELat KNEL LKNE "
            "LKnee FLE LFE LFC LE LEP LEK CL LCON KNEEL LFEC Femur.Lat",
            "knee_medial": "MKnee MKNE KneeMed Med.Knee Medial.Knee Knee.Medial KneeIn KneeInt KNEIn KNEMed KNEM FME MFE MFC "
            "ME MEP MEK CM MCON KNM KNI KNEEM MFEC Femur.Med",
            "patella": "PAT Patella",
            "fibula_head": "HF HFB FAX Fibula.Head FH FIB HFIB",
            "tibial_tuberosity": "TT TUB TTC TTUB Tibial.Tuberosity",
            "shin": "SHN Shin Shin.Front.High Shin.Front",
            "malleolus_lateral": "Ankle ANK AnkleLat Lat.Ankle Lateral.Ankle Ankle.Lateral AnkleOut AnkleExt ANKOut ANKLat ANKL "
            "LANK LAnkle LMAL LMall LMA LM ML FAL MALL LAT.MAL Malleolus.Lat",
            "malleolus_medial": "MAnkle MANK AnkleMed Med.Ankle Medial.Ankle Ankle.Medial AnkleIn AnkleInt ANKIn ANKMed ANKM MMAL "
            "MMall MMA MM TAM ANM MED.MAL Malleolus.Med",
            "heel_marker": "Heel HEE HEEL CAL CALC CA FCC PCA Heel.Back Heel.Bottom Heel.Top Calcaneus HL",
            "heel_lateral": "LCA Heel.Lateral Heel.Lat",
            "heel_medial": "STL MCA Heel.Medial Heel.Med",
            "midfoot_medial": "NAV P1M Midfoot.Med P1MT Navicular",
            "midfoot_lateral": "P5M P5MT Styloid CUB Cuboid",
            "metatarsal_1": "MT1 1MT M1 FM1 FM FMH MH1 D1M D1MT META1 1META MET1 MTP1 1MTP 1MTH MTH1 1MHD 1MET Forefoot.In "
            "MT1 1MT M1 FM1 FM FMH MH1 D1M D1MT META1 1META MET1 MTP1 1MTP 1MTH MTH1 1MHD 1MET Forefoot.In",
            "metatarsal_2": "Toe TOE FM2 SM SMH MH2 D2M D2MT 2MT M2 META2 2META MET2 MTP2 MTH2 2MTH 2MHD Forefoot FT23 "
            "Toe TOE FM2 SM SMH MH2 D2M D2MT 2MT M2 META2 2META MET2 MTP2 MTH2 2MTH 2MHD Forefoot FT23",
            "metatarsal_5": "MT5 5MT M5 FM5 VM VMH MH5 D5M D5MT META5 5META MET5 MTP5 5MTP 5MTH MTH5 5MHD 5MET Forefoot.Out "
            "MT5 5MT M5 FM5 VM VMH MH5 D5M D5MT META5 5META MET5 MTP5 5MTP 5MTH MTH5 5MHD 5MET Forefoot.Out",
            "toe_tip": "Toe.Tip Hallux HLX HAL HX TTIP BigToe Big.Toe",
            "acromion": "Shoulder SHO ACR Acromion Acromium AC ACRO SAE SHLD ACJ Shoulder.Top Acr SHOULD",
            "shoulder_front": "ASH",
            "shoulder_back": "PSH Shoulder.Back",
            "sternoclavicular": "Clavicle Clav SC SCJ SternoClav",
            "scapula": "Scapula SCAP Back BAK SIA",
            "upper_arm": "UA UPA UArm Upper.Arm Arm ARM Humerus HUM UA1 UA2 UA3 UArm1 UArm2 UArm3",
            "biceps": "Biceps Bicep BIC",
            "elbow_lateral": "Elbow ELB LEL LElbow LELB ELBL ElbowLat Elbow.Lateral Lat.Elbow ElbowOut ELBLat ELBOut HLE EL "
            "HEL LHE LEH",
            "elbow_medial": "MElbow MELB MEL ELBM ElbowMed Elbow.Medial Med.Elbow ElbowIn ELBMed ELBIn HME EM HEM MHE MEH "
            "MElbow MELB MEL ELBM ElbowMed Elbow.Medial Med.Elbow ElbowIn ELBMed ELBIn HME EM HEM MHE MEH",
            "forearm": "Forearm FRM FRA FA FArm Fore.Arm FASuperior FA1 FA2 FA3 LARM",
            "radius": "WRA LWrist RSP RS FARadius Radius RAD WristRad Wrist.Radius WRR WRIL Wrist.Lateral WristThumb "
            "WristIn WRT RST",
            "ulna": "WRB MWrist USP US FAUlna Ulna ULN WristUln Wrist.Ulna WRU WRIM Wrist.Medial WristPinky WristOut "
            "UST",
            "wrist_back": "Wrist WRI WR",
            "hand_back": "Hand FIN HAND HM2 MC2 MCP2 MC3 MCP3 M3 HandIn Finger HM3 Hand.Back",
            "hand_back_5": "HM5 MC5 MCP5 HandOut",
            "temple": "Temple HEAD Head HD TMP",
            "forehead": "FHD Front.Head",
            "occiput": "BHD Back.Head",
        }
    ),
    **dict.fromkeys(("HeadL", "LHead.Side"), "left_temple"),
    **dict.fromkeys(("HeadR", "RHead.Side"), "right_temple"),
    **{
        f"Waist{side}{end}": f"{name}_{site}"
        for side, name in (("L", "left"), ("R", "right"))
        for end, site in (("Front", "asis"), ("Back", "psis"))
    },
    **{f"Back{side}": f"{name}_scapula" for side, name in (("L", "left"), ("R", "right"))},
    **{
        word: site
        for site, words in {
            "head_top": "HeadTop Top.Head HTOP Vertex Head.Top TopHead HDTP",
            "forehead": "HeadFront FHD Front.Head HDFR Head.Front GLAB SGL Glabella",
            "occiput": "HeadBack BHD Back.Head HDBK Head.Back OCC",
            "c7": "C7 CV7 VC7 SpineTop Spine.Top Neck.Back",
            "clavicle": "CLAV IJ SJN JN SSN Manubrium MAN MANU Jugular Sternal.Notch",
            "sternum": "Sternum STERN STE Chest STRNM",
            "lower_sternum": "STRN PX XP XIPH Xiphoid SXS XYP",
            "sacrum": "SACR Sacrum SAC VSAC Sacral V.Sacral S1 S2 MPSI PSIS.Mid WaistBack",
        }.items()
        for word in words.split()
    },
    **{name: f"t{n}" for n in (*range(1, 10), 11, 12) for name in (f"T{n}", f"TV{n}", f"Th{n}")},
    **dict.fromkeys(("T10", "TV10", "Th10", "SpineThoracic10"), "t10"),
    **{name: f"l{n}" for n in range(1, 6) for name in (f"L{n}", f"LV{n}")},
    # Clusters on plates and wands: every laboratory has them elsewhere on the part.
    **_aliases(
        {
            "thigh": " TH{n} Thigh{n} THI{n} TC{n} FT{n}Thigh THI THIGH",
                    *(f"Thigh.{a}.{b}" for a in ("Top", "Bottom") for b in ("Lateral", "Medial")),
                    "Thigh.Upper Thigh.Front Thigh.Rear Thigh.Lower Thigh.Lat Thigh.Front.Low FPL FAL1",
                ]
            ),
            "shank": " SH{n} Shank{n} TB{n} TIB{n} SK{n} SHK{n} Tibia{n}Shank.{a}.{b}TopBottomLateralMedialShank TIB "
            "SHANK SHK Tibia Shank.Upper Shank.Front Shank.Rear Shank.Lower Shank.AntSup TPL",
                ]
            ),
        }
    ),
}

# Points of the body as cameras see them: joints and points of the skin, by OpenPose's and MediaPipe's names.
KEYPOINTS: dict[str, Meaning] = {
    "Nose": "nose",
    "Head": "head_top",
    "Neck": "mid_shoulder",
    "MidHip": "mid_hip",
    "Hip": "mid_hip",
    **_aliases(
        {
            "eye": "Eye",
            "ear": "Ear",
            "shoulder": "Shoulder",
            "elbow": "Elbow",
            "wrist": "Wrist",
            "hip": "Hip",
            "knee": "Knee",
            "ankle": "Ankle",
            "big_toe": "BigToe",
            "small_toe": "SmallToe",
            "heel": "Heel",
        }
    ),
}

# What two sets call by one name is what the first of these calls so.
MARKERS: dict[str, Meaning] = {**OTHERS, **PLUG_IN_GAIT, **OPENCAP, **OPENSIM_GAIT}

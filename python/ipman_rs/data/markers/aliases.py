"""What other marker sets call the same places: words without their sides, by site.

Of Rajagopal's and Camargo's models, the ISB's recommendations, Dumas's, the Istituto Ortopedico Rizzoli's, Cleveland
Clinic's, Helen Hayes, CAST, BMClab's data sets, Qualisys' sets for sports and CAST, the Oxford foot model. Case and
punctuation do not count (`names`).
"""

from __future__ import annotations

SIDED_WORDS = {
    "asis": "ASI ASIS IAS SIAS Waist.Front",
    "psis": "PSI PSIS IPS SIPS Waist.Back",
    "iliac_crest": "Iliac.Crest ICrest Crest ILC ICR ICT Iliac",
    "trochanter": "GTR GT TROC Troch Trochanter GTROC Greater.Trochanter FTC TRO",
    "hip_centre": "HJC Hip.Joint HipJC Hip.Joint.Centre Hip.Joint.Center HipCenter HipCentre",
    "knee": "KJC Knee.Joint KneeJC Knee.Joint.Centre Knee.Joint.Center KneeCenter KneeCentre",
    "ankle": "AJC Ankle.Joint AnkleJC Ankle.Joint.Centre Ankle.Joint.Center AnkleCenter AnkleCentre",
    "shoulder": "SJC Shoulder.Joint ShoulderJC Shoulder.Joint.Centre Shoulder.Joint.Center GHJC",
    "elbow": "EJC Elbow.Joint ElbowJC Elbow.Joint.Centre Elbow.Joint.Center",
    "wrist": "WJC Wrist.Joint WristJC Wrist.Joint.Centre Wrist.Joint.Center",
    "knee_lateral": """
        Knee KNE KneeLat Lat.Knee Lateral.Knee Knee.Lateral KneeOut KneeExt KNEOut KNELat KNEL LKNE LKnee KneeL
        FLE LFE LFC LE LEP LEK CL LCON LFEC Femur.Lat
    """,
    "knee_medial": """
        MKnee MKNE KneeMed Med.Knee Medial.Knee Knee.Medial KneeIn KneeInt KNEIn KNEMed KNEM KneeM
        FME MFE MFC ME MEP MEK CM MCON KNM KNI MFEC Femur.Med
    """,
    "patella": "PAT Patella",
    "fibula_head": "HF HFB FAX Fibula.Head FH FIB HFIB",
    "tibial_tuberosity": "TT TUB TTC TTUB Tibial.Tuberosity",
    "shin": "SHN Shin Shin.Front.High Shin.Front",
    "malleolus_lateral": """
        Ankle ANK AnkleLat Lat.Ankle Lateral.Ankle Ankle.Lateral AnkleOut AnkleExt ANKOut ANKLat ANKL LANK LAnkle
        AnkleL LMAL LMall LMA LM ML FAL Mall Lat.Mal Malleolus.Lat
    """,
    "malleolus_medial": """
        MAnkle MANK AnkleMed Med.Ankle Medial.Ankle Ankle.Medial AnkleIn AnkleInt ANKIn ANKMed ANKM AnkleM
        MMAL MMall MMA MM TAM ANM Med.Mal Malleolus.Med
    """,
    "heel_marker": "Heel HEE CAL CALC CA FCC PCA Heel.Back Heel.Bottom Heel.Top Calcaneus HL",
    "heel_lateral": "LCA Heel.Lateral Heel.Lat",
    "heel_medial": "STL MCA Heel.Medial Heel.Med",
    "midfoot_medial": "NAV P1M Midfoot.Med P1MT Navicular",
    "midfoot_lateral": "P5M P5MT Styloid CUB Cuboid",
    "metatarsal_1": """
        MT1 1MT M1 FM1 FM FMH MH1 D1M D1MT META1 1META MET1 1MET MTP1 1MTP 1MTH MTH1 1MHD Forefoot.In
    """,
    "metatarsal_2": """
        Toe FM2 SM SMH MH2 D2M D2MT 2MT M2 META2 2META MET2 2MET MTP2 2MTP MTH2 2MTH 2MHD Forefoot FT23
    """,
    "metatarsal_5": """
        MT5 5MT M5 FM5 VM VMH MH5 D5M D5MT META5 5META MET5 5MET MTP5 5MTP 5MTH MTH5 5MHD Forefoot.Out
    """,
    "toe_tip": "Toe.Tip Hallux HLX HAL HX TTIP BigToe Big.Toe",
    "acromion": "Shoulder SHO ACR Acromion Acromium AC ACRO SAE SHLD ACJ Shoulder.Top",
    "shoulder_front": "ASH Shoulder.Front",
    "shoulder_back": "PSH Shoulder.Back",
    "sternoclavicular": "Clavicle Clav SC SCJ SternoClav",
    "scapula": "Scapula SCAP Back BAK SIA",
    "upper_arm": "UA UPA UArm Upper.Arm Arm Humerus HUM UA1 UA2 UA3 UArm1 UArm2 UArm3",
    "biceps": "Biceps Bicep BIC",
    "elbow_lateral": """
        Elbow ELB LEL LElbow LELB ELBL ElbowLat Elbow.Lateral Lat.Elbow ElbowOut ELBLat ELBOut HLE EL HEL LHE LEH
    """,
    "elbow_medial": """
        MElbow MELB MEL ELBM ElbowMed Elbow.Medial Med.Elbow ElbowIn ELBMed ELBIn HME EM HEM MHE MEH
    """,
    "forearm": "Forearm FRM FRA FA FArm Fore.Arm FASuperior FA1 FA2 FA3",
    "radius": """
        WRA LWrist RSP RS FARadius Radius RAD WristRad Wrist.Radius WRR WRIL Wrist.Lateral WristThumb WristIn WRT RST
    """,
    "ulna": "WRB MWrist USP US FAUlna Ulna ULN WristUln Wrist.Ulna WRU WRIM Wrist.Medial WristPinky WristOut UST",
    "wrist_back": "Wrist WRI WR",
    "hand_back": "Hand FIN HM2 MC2 MCP2 MC3 MCP3 M3 HandIn Finger HM3 Hand.Back",
    "hand_back_5": "HM5 MC5 MCP5 HandOut",
    "temple": "Temple Head HD TMP",
    "forehead": "FHD Front.Head",
    "occiput": "BHD Back.Head",
    # Clusters on plates and wands: every laboratory has them elsewhere on the part.
    "thigh": """
        Thigh THI TH1 TH2 TH3 TH4 TH5 Thigh1 Thigh2 Thigh3 Thigh4 Thigh5 THI1 THI2 THI3 THI4 FT1 FT2 FT3 FT4
        Thigh.Top.Lateral Thigh.Bottom.Lateral Thigh.Top.Medial Thigh.Bottom.Medial Thigh.Upper Thigh.Lower
        Thigh.Front Thigh.Rear Thigh.Lat Thigh.Front.Low
    """,
    "shank": """
        Shank TIB Tibia SHK SH1 SH2 SH3 SH4 SH5 Shank1 Shank2 Shank3 Shank4 Shank5 TB1 TB2 TB3 TB4 TIB1 TIB2 TIB3 TIB4
        SK1 SK2 SK3 SK4 SHK1 SHK2 SHK3 SHK4 Shank.Top.Lateral Shank.Bottom.Lateral Shank.Top.Medial
        Shank.Bottom.Medial Shank.Upper Shank.Lower Shank.Front Shank.Rear Shank.AntSup
    """,
}
MIDDLE_WORDS = {
    "head_top": "HeadTop Top.Head HTOP Vertex HDTP",
    "forehead": "HeadFront FHD Front.Head HDFR GLAB SGL Glabella",
    "occiput": "HeadBack BHD Back.Head HDBK OCC",
    "left_temple": "HeadL",
    "right_temple": "HeadR",
    "c7": "C7 CV7 VC7 SpineTop",
    "t10": "T10 TV10 Th10",
    **{f"t{n}": f"T{n} TV{n} Th{n}" for n in (*range(1, 10), 11, 12)},
    **{f"l{n}": f"L{n} LV{n}" for n in range(1, 6)},
    "clavicle": "CLAV IJ SJN JN SSN Manubrium MAN MANU Jugular Sternal.Notch",
    "sternum": "Sternum STERN STE Chest",
    "lower_sternum": "STRN PX XP XIPH Xiphoid SXS XYP",
    "sacrum": "SACR Sacrum SAC VSAC Sacral V.Sacral S1 S2 MPSI WaistBack",
    "left_asis": "WaistLFront",
    "right_asis": "WaistRFront",
    "left_psis": "WaistLBack",
    "right_psis": "WaistRBack",
    "left_scapula": "BackL",
    "right_scapula": "BackR RBAK",
}
# Points of the body as cameras see them: joints and points of the skin, by OpenPose's and MediaPipe's names.
SIDED_KEYPOINTS = {
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


def _sided(words: dict[str, str]) -> dict[str, str]:
    """Markers of both sides, by name."""
    return {
        f"{prefix}.{word}": f"{side}_{site}"
        for site, names in words.items()
        for word in names.split()
        for side, prefix in {"left": "L", "right": "R"}.items()
    }


OTHERS = {
    **_sided(SIDED_WORDS),
    **{word: site for site, words in MIDDLE_WORDS.items() for word in words.split()},
}
KEYPOINTS = {
    "Nose": "nose",
    "Head": "head_top",
    "Neck": "mid_shoulder",
    "MidHip": "mid_hip",
    "Hip": "mid_hip",
    **_sided(SIDED_KEYPOINTS),
}

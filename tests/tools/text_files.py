"""Small files of the formats that list measurements as text, written by hand: what tests read and fuzzing damages."""

from __future__ import annotations

import struct

ASTM = """TITLE grey tile
SAMPLE_ID 7
NUM_POINTS 3
VARS theta_i,phi_i,theta_s,phi_s,R,G,B
0.5,0.0,0.25,3.0,0.1,0.2,0.3
0.5,0.0,0.50,3.0,0.4,0.5,0.6
0.5,0.0,0.75,3.0,0.7,0.8,0.9
"""

PAB = """#data written by hand
#sample_name "tile"
#intheta 30
#inphi 0
#upphi 90
#incident_angle 30 0
#datapoints_in_file: 4
#format: theta phi DSF
0 0 0.25
0 180 0.25
60 0 0.1
60 180 0.4
"""

ALTA = """#DIM 3 1
#PARAM_IN ISOTROPIC_TV_TL_DPHI
#PARAM_OUT INV_STERADIAN
#VS 2
# theta_v theta_l phi value lower upper
0.1 0.3 0.0 0.25 0.20 0.30
0.1 0.3 3.0 0.50 0.45 0.60
0.2 0.3 0.0 0.75 0.70 0.80
0.2 0.3 3.0 1.00 0.90 1.10
"""

INTEGRA = """;; written by hand
Source Measured
TypeSym PlaneSymmetrical
TypeColorModel BW
TypeData Luminance Absolute
sigma 2
 0 45
phi 2
 0 180
theta 3
 0 30 90
bw
 kbdf
 1.0 0.5
 def
;; Sigma = 0
 1 2 3
 1 5 6
;; Sigma = 45
 7 8 9
 7 11 12
 enddef
"""

SSDD = """VERSION 0.2
SOFTWARE by hand

DATA_TYPE brdf
COLOR_MODEL rgb
PARAM_TYPE half_difference_coordinate_system
REDUCTION_TYPE bilateral_symmetry reciprocity
PARAM0_LIST 0 90
PARAM2_LIST 0 45 90
PARAM3_LIST 0 90
NAME graues Gerät
DATA ascii
# PARAM3: 0
1 2 3
4 5 6
7 8 9
10 11 12
13 14 15
16 17 18
# PARAM3: 90
19 20 21
22 23 24
25 26 27
28 29 30
31 32 33
34 35 36

# the same for all directions
DATA_TYPE specular_transmittance
COLOR_MODEL monochrome
PARAM0_LIST 0 90
DATA ascii
0.05
0.06
"""

CSV = """# sample: grey tile
theta_i,phi_i,theta_o,phi_o,f_R,f_G,u_f_R,u_f_G
30,0,0,180,0.1,0.2,0.01,0.02
30,0,45,180,0.3,0.4,0.01,0.02
30,0,60,180,0.5,,0.01,
"""


def alta_binary(order: str = "<", rows: tuple = ((0.1, 0.3, 0.0, 0.25), (0.1, 0.3, 3.0, 0.5))) -> bytes:
    head = (
        "#DIM 3 1\n#PARAM_IN  ISOTROPIC_TV_TL_DPHI\n#PARAM_OUT INV_STERADIAN_COSINE_FACTOR\n#FORMAT binary\n"
        f"#VERSION 0\n#PRECISION ieee754-double\n#SAMPLE_COUNT {len(rows)}\n#VS 0\n"
        f"#ENDIAN {'little' if order == '<' else 'big'}\n#BEGIN_STREAM\n"
    )
    return head.encode() + b"".join(struct.pack(f"{order}{len(r)}d", *r) for r in rows) + b"\n#END_STREAM\n"


def ssdd_binary() -> bytes:
    """A specular grid as float32, then a block of text."""
    head = (
        "VERSION 0.2\nDATA_TYPE brdf\nCOLOR_MODEL spectrum\nWAVELENGTH_LIST 450 550.5\n"
        "PARAM_TYPE specular_coordinate_system\nPARAM0_LIST 0 45\nPARAM2_LIST 0 30 90\nPARAM3_LIST 0 90 180 270\n"
        "DATA binary\n"
    )
    tail = "\nDATA_TYPE specular_reflectance\nCOLOR_MODEL monochrome\nPARAM0_LIST 0\nDATA ascii\n0.5\n"
    return head.encode() + struct.pack("<48f", *(0.125 * k for k in range(48))) + tail.encode()


SEEDS = {
    "ASTM": ASTM.encode,
    "pab-opto": PAB.encode,
    "ALTA": ALTA.encode,
    "ALTA binary": alta_binary,
    "Integra": INTEGRA.encode,
    "SSDD": SSDD.encode,
    "SSDD binary": ssdd_binary,
    "CSV": CSV.encode,
}

"""Small files of optical design software and of the RT-300S, written without gonio: for its tests and as seeds."""

from __future__ import annotations

import struct
from collections.abc import Callable

ZEMAX = """#made by hand
#second comment
Source  Measured
Symmetry  {symmetry}
SpectralContent  Monochrome
ScatterType  {kind}
SampleRotation  1
0
AngleOfIncidence  2
0 30
ScatterAzimuth 3
{azimuth}
ScatterRadial 2
0\t40\t

Monochrome
DataBegin
TIS 0.25
1e-1\t2.5E-02
1e-1\t3.5E-02
1e-1\t4.5E-02
TIS 0.125
.2\t5.5E-02
.2\t6.5E-02
.2\t7.5E-02
DataEnd
"""

ZEMAX_XYZ = """Symmetry ASymmetrical4D
SpectralContent XYZ
ScatterType BRDF
SampleRotation 2
0 90
AngleOfIncidence 1
20
ScatterAzimuth 2
0 180
ScatterRadial 2
0 10

""" + "".join(
    f"Tristimulus{name}\nDataBegin\nTIS 0.{k}\n{k} {k}.1\n{k} {k}.2\nTIS 0.{k}5\n{k} {k}.3\n{k} {k}.4\nDataEnd\n"
    for k, name in enumerate("XYZ", start=1)
)

LIGHTTOOLS = """# made by hand
Symmetry Asymmetric
SpectralContent Monochrome
ScatterAzimuth 4
0 90 180 270
ScatterRadial 2
0 45
DataBegin
AOI 0
POI 90
Side Front
Wavelength 550
ScatterType BRDF
TIS 0.5
0.1 0.2
0.1 0.3
0.1 0.2
0.1 0.4
AOI 40
POI 90
Side Front
Wavelength 550
ScatterType BRDF
TIS 0.25
0.5 0.6
0.5 0.7
0.5 0.6
0.5 0.8
AOI 0
POI 90
Side Front
Wavelength 550
ScatterType BTDF
TIS 0.125
0.01 0.02
0.01 0.02
0.01 0.02
0.01 0.02
DataEnd
"""

SPEOS = """OPTIS - brdf surface file v8.0
0
a comment
11
two
lines..
1\t0
{flag}
2\t2
0\t40
500\t600
{tables}"""

SPEOS_ANISOTROPIC = """OPTIS - Anisotropic BSDF surface file v8.0
0
Comment
23
Measurement description
0\t1\t0
1\t0
1
2
0\t90
1
20
1
20
20\t0
Reflection Spectrum
2
400\t10
800\t30
2 4
\t0\t90\t180\t270
0\t1\t1\t1\t1
60\t2\t3\t4\t3
2 4
\t0\t90\t180\t270
0\t5\t5\t5\t5
60\t6\t7\t8\t9
End of file
"""

FRED = """type bsdf_data
format angles=deg bsdf=value scale={scale}
10\t0
0\t0\t0.5
30\t0\t0.25
30\t90\t0.125
30\t180\t.0625
"""

JDV = """DataType:\tBRDF(RT-300S)\t \t
SampleID:\tSample 0\t \t
Date:\t7/12/2011\t\t
Incidence:\t30\t \t
Polar:\t-30,30,30\t \t
Azimuth:\t-90,0,90\t \t
\t\t\t
Raw data\t\t\t
\t-30\t0\t30
-90\t1\t2\t3
0\t4\t2\t5
\t\t\t
"""

RAYWIZ = """DataType:\tBRDF(Raywiz)\t \t
SampleID:\tSample 0\t \t
Date:\t7/12/2011\t\t
1\t1\t2\t
-90\t0\t-30\t30
30\t\t\t
1\t4\t\t
2\t2\t\t
3\t5\t\t
"""

REFLET = """Name / Comment :\tSample 0\t
Date:\t7/12/2011 11:51:11 PM\t
Theta measure beginning :\t-30\t
Theta measure end :\t30\t
Theta measure step :\t30\t
'Scanning :\t2 axes\t
Phi measure beginning :\t-90\t
Phi measure end :\t0\t
Phi measure step :\t90\t
Theta Lighting\t30\t
-30\t1\t4
0\t2\t2
30\t3\t5
"""

RTD = """OPTIS - Anisotropic BSDF surface file v1.0\t\t\t
SampleID:\tSample 30\t \t
0 1 0\t\t\t
1\t0\t\t
0\t\t\t
1\t\t\t
3\t\t\t
0 45 90\t\t\t
10 0\t\t\t
Reflection Spectrum\t\t\t
2\t\t\t
100 50\t\t\t
1000 50\t\t\t
\t-90\t0\t
-30\t1\t4\t
0\t2\t2\t
30\t3\t5\t
\t\t\t
\t0\t180\t190
0\t2\t2\t2
30\t3\t3\t4
"""

SHEET: list[list[str | float]] = [
    [" Method", "BRDF_LD", "BRDF_LD", "BRDF_LD", "BRDF_LD", "BRDF_LD", "BRDF_LD"],
    [" Azimuth", -90.0, -90.0, -90.0, 0.0, 0.0, 0.0],
    [" Incidence", 30.0, 30.0, 30.0, 30.0, 30.0, 30.0],
    [" Receive", -30.0, 0.0, 30.0, -30.0, 0.0, 30.0],
    [" RT", 1.0, 2.0, 3.0, 4.0, 2.0, 5.0],
    [380.0, 1e-6, 1e-6, 1e-6, 1e-6, 1e-6, 1e-6],
]


def speos(flag: int = 1) -> str:
    """Four tables of theta 0, 60 and phi 0, 180 whose shares are 10 to 40 %."""
    tables = "".join(f"{10 * k}\n2\t2\n\t0\t180\n0\t{k}\t{k}\n60\t{k}.5\t{k}.25\n" for k in range(1, 5))
    return SPEOS.format(flag=flag, tables=tables)


def zemax(symmetry: str = "PlaneSymmetrical", kind: str = "BRDF", azimuth: str = "0 90 180") -> str:
    return ZEMAX.format(symmetry=symmetry, kind=kind, azimuth=azimuth)


def workbook(sheet: list[list[str | float]]) -> bytes:
    """An Excel 97 workbook of one sheet: records in a stream, and that in an OLE container of 512-byte sectors."""

    def record(kind: int, body: bytes) -> bytes:
        return struct.pack("<HH", kind, len(body)) + body

    def bof(kind: int) -> bytes:
        return record(0x809, struct.pack("<HHHHII", 0x600, kind, 0xDBB, 0x7CC, 0, 6))

    cells = b""
    for r, row in enumerate(sheet):
        for c, cell in enumerate(row):
            if isinstance(cell, str):
                cells += record(0x204, struct.pack("<HHHHB", r, c, 0, len(cell), 0) + cell.encode("latin-1"))
            else:
                cells += record(0x203, struct.pack("<HHHd", r, c, 0, cell))
    end, name = record(0x0A, b""), b"Sheet1"
    page = record(0x42, struct.pack("<H", 1200))
    at = len(bof(5) + page + end) + 4 + 8 + len(name)
    entry = record(0x85, struct.pack("<IBBBB", at, 0, 0, len(name), 0) + name)
    stream = (bof(5) + page + entry + end + bof(0x10) + cells + end).ljust(4096, b"\0")
    sectors = -(-len(stream) // 512)
    stream = stream.ljust(512 * sectors, b"\0")

    def named(name: str, kind: int, child: int, start: int, size: int) -> bytes:
        title = (name + "\0").encode("utf-16-le")
        head = title.ljust(64, b"\0") + struct.pack("<HBB", len(title) if name else 0, kind, 1)
        return head + struct.pack("<iii", -1, -1, child) + b"\0" * 36 + struct.pack("<IQ", start & 0xFFFFFFFF, size)

    directory = named("Root Entry", 5, 1, -2, 0) + named("Workbook", 2, -1, 2, len(stream)) + named("", 0, -1, 0, 0) * 2
    chain = [-3, -2, *range(3, sectors + 2), -2]
    fat = struct.pack(f"<{len(chain)}i", *chain).ljust(512, b"\xff")
    header = b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1" + b"\0" * 16 + struct.pack("<HHHHH", 0x3E, 3, 0xFFFE, 9, 6) + b"\0" * 6
    header += struct.pack("<IIiIIiIiI", 0, 1, 1, 0, 4096, -2, 0, -2, 0) + struct.pack("<i", 0) + b"\xff" * 432
    return header + fat + directory + stream


SEEDS: dict[str, Callable[[], bytes]] = {
    "Zemax": lambda: zemax().encode(),
    "Zemax 4D": lambda: ZEMAX_XYZ.encode(),
    "LightTools": lambda: LIGHTTOOLS.encode(),
    "Speos": lambda: speos().encode(),
    "Speos anisotropic": lambda: SPEOS_ANISOTROPIC.encode(),
    "FRED": lambda: FRED.format(scale=1).encode(),
    "RT-300S": lambda: JDV.encode(),
    "RT-300S Raywiz": lambda: RAYWIZ.encode(),
    "RT-300S Reflet": lambda: REFLET.encode(),
    "RT-300S Speos": lambda: RTD.encode(),
    "RT-300S workbook": lambda: workbook(SHEET),
}

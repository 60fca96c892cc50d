"""Form factors (view factors): the share of what one diffuse surface sends out that arrives at another.

F12 = 1/A1 ∫∫ cosθ₁ cosθ₂/(π r²) dA₂ dA₁, with nothing in between; A1 F12 = A2 F21, and in a closed room the factors
of a surface sum to 1. `point_...` are factors from a small flat element. Lengths in any one unit; numbers or arrays
that broadcast; float32 arrays give float32. "Error rounding" is an absolute error below 1e-15 in float64; numbers
like C-41 are those of Howell's catalogue of configuration factors, whose formulas were integrated again here.
"""

import numpy as np

from ..declared.arrays import Array
from ..declared.arrays import formula as _formula
from ..declared.namespace import own_names
from ..errors import ParameterError
from ._outlines import exchanged
from .kinds import _NotNegative, _Polar, _Polygon, _Positive, _Vector
from .solid_angles import projected_solid_angle_cone, projected_solid_angle_polygon

# From a small element


@_formula
def point_to_polygon(vertices: _Polygon, normal: _Vector = (0.0, 0.0, 1.0)) -> Array:
    """Element at the origin to a plane polygon: F = 1/(2π) |Σ θ_i n·γ_i|, of what is above the element's horizon.

    θ_i is the angle of an edge seen from the element, γ_i the unit vector along v_i × v_i₊₁.

    Shapes vertices (..., V, 3) in order, normal (..., 3) -> ... Units any length -> 1.
    Error  as `projected_solid_angle_polygon`, over π.
    Source Lambert 1760, Photometria.

    Example
    >>> window = [[1.0, -1.0, 2.0], [1.0, 1.0, 2.0], [-1.0, 1.0, 2.0], [-1.0, -1.0, 2.0]]
    >>> print(gn.radiometry.form_factors.point_to_polygon(window).round(4))
    0.2395
    """
    return projected_solid_angle_polygon(vertices, normal) / np.pi


@_formula
def point_to_parallel_rectangle(a: _NotNegative, b: _NotNegative, distance: _Positive) -> Array:
    """Element to a rectangle a × b in a parallel plane, one corner of which is on the element's normal (B-3).

    F = 1/(2π) (A/√(1+A²) atan(B/√(1+A²)) + B/√(1+B²) atan(A/√(1+B²))), A = a/c, B = b/c, c the distance.

    Shapes broadcast. Units any length -> 1. Error rounding.
    Source Lambert's formula of the four edges, two of which contribute.

    Example
    >>> print(gn.radiometry.form_factors.point_to_parallel_rectangle(1.0, 1.0, distance=1.0).round(4))
    0.1385
    """
    x, y = a / distance, b / distance
    p, q = np.sqrt(1.0 + x * x), np.sqrt(1.0 + y * y)
    return (x / p * np.arctan(y / p) + y / q * np.arctan(x / q)) / (2.0 * np.pi)


@_formula
def point_to_perpendicular_rectangle(width: _NotNegative, height: _NotNegative, distance: _Positive) -> Array:
    """Element to a rectangle standing on the element's plane, one lower corner of which is nearest to it (B-4).

    F = 1/(2π) (atan(b/c) − c/√(a²+c²) atan(b/√(a²+c²))): width b, height a above the plane, distance c.

    Shapes broadcast. Units any length -> 1. Error rounding.
    Source Lambert's formula: of the four edges the lower and the upper contribute.

    Example
    >>> print(gn.radiometry.form_factors.point_to_perpendicular_rectangle(1.0, 1.0, distance=1.0).round(4))
    0.0557
    """
    far = np.hypot(height, distance)
    return (np.arctan(width / distance) - distance / far * np.arctan(width / far)) / (2.0 * np.pi)


@_formula
def point_to_disk(radius: _NotNegative, distance: _Positive, offset: _NotNegative = 0.0) -> Array:
    """Element to a disk in a parallel plane, whose centre is `offset` away from the element's normal (B-13).

    F = ½ (1 − (a²+h²−r²)/√((a²+h²+r²)² − 4a²r²)): offset a, distance h of the planes, radius r.

    Shapes broadcast. Units any length -> 1. Error rounding, relative too for small disks.
    Source The limit of `coaxial_disks` for two that share an axis of revolution; integrated again in the tests.

    Example
    >>> print(gn.radiometry.form_factors.point_to_disk(1.0, distance=1.0))
    0.5
    """
    over = offset * offset + distance * distance - radius * radius
    root = np.hypot(offset - radius, distance) * np.hypot(offset + radius, distance)
    product = 2.0 * np.square(distance * radius)
    return np.where(over > 0.0, product / (root * (root + np.abs(over))), 0.5 - 0.5 * over / root)[()]


@_formula
def point_to_sphere(radius: _NotNegative, distance: _Positive, theta: _Polar = 0.0) -> Array:
    """Element to a sphere whose centre is at `distance` and θ from the normal: (r/d)² cosθ, above the horizon.

    Where the horizon cuts the sphere, `projected_solid_angle_cone` of sin a = r/d, over π.

    Shapes broadcast. Units any length, rad -> 1. Error absolute, 1e-15; radius ≤ distance.
    Source Lambert 1760, Photometria: the contour integral along the circle and the horizon.

    Example
    >>> print(gn.radiometry.form_factors.point_to_sphere(0.5, distance=1.0).round(4))
    0.25
    """
    if np.any(radius > distance):
        raise ParameterError("radius must be at most distance, got more: the element is inside the sphere, F = 1")
    return projected_solid_angle_cone(np.arcsin(radius / distance), theta) / np.pi


# Rectangles and disks


@_formula
def parallel_rectangles(a: _Positive, b: _Positive, distance: _Positive) -> Array:
    """Between two equal rectangles a × b, straight opposite each other (C-11).

    F = 2/(πXY) (½ ln((1+X²)(1+Y²)/(1+X²+Y²)) + X q atan(X/q) + Y p atan(Y/p) − X atan X − Y atan Y), X = a/c, Y = b/c,
    p = √(1+X²), q = √(1+Y²), c the distance.

    Shapes broadcast. Units any length -> 1.
    Error  of 400 rectangles, sides 1e-3 to 1e4 of the distance: absolute 1e-13; relative 2e-10, of the smallest.
    Source The double contour integral, whose edges have closed forms.

    Example
    >>> print(gn.radiometry.form_factors.parallel_rectangles(1.0, 1.0, distance=1.0).round(6))
    0.199825
    """
    x, y = a / distance, b / distance
    p, q = np.hypot(1.0, x), np.hypot(1.0, y)
    log = 0.5 * np.log1p(np.square(x / np.hypot(p, y) * y))
    # q atan(X/q) − atan X by the difference of the angles: both are alike where Y is small
    first = x * ((q - 1.0) * np.arctan(x / q) - np.arctan2(x * (q - 1.0), q + x * x))
    second = y * ((p - 1.0) * np.arctan(y / p) - np.arctan2(y * (p - 1.0), p + y * y))
    return 2.0 / np.pi * (log + first + second) / x / y


@_formula
def perpendicular_rectangles(common: _Positive, depth_1: _Positive, depth_2: _Positive) -> Array:
    """From a rectangle to one perpendicular to it that shares an edge: floor to wall (C-14).

    F = 1/(πW) (W atan(1/W) + H atan(1/H) − S atan(1/S) + ¼ ln((1+W²)(1+H²)/(1+S²)) + ¼ W² ln(W²(1+S²)/((1+W²)S²)) +
    ¼ H² ln(H²(1+S²)/((1+H²)S²))), S² = W² + H², W = depth_1/common of the one it is from, H = depth_2/common.

    Shapes broadcast. Units any length -> 1.
    Error  absolute, of 400 pairs, depths 1/100 to 100 of the edge: 4e-15.
    Source The double contour integral, whose edges have closed forms.

    Example
    >>> print(gn.radiometry.form_factors.perpendicular_rectangles(1.0, 1.0, 1.0).round(6))
    0.200044
    """
    w, h = depth_1 / common, depth_2 / common
    s = np.hypot(w, h)
    angles = w * np.arctan2(1.0, w) + h * np.arctan2(1.0, h) - s * np.arctan2(1.0, s)
    w2, h2, s2 = w * w, h * h, s * s
    logs = (
        np.log1p(w2 * h2 / (1.0 + s2)) - w2 * np.log1p(h2 / (w2 * (1.0 + s2))) - h2 * np.log1p(w2 / (h2 * (1.0 + s2)))
    )
    return (angles + 0.25 * logs) / (np.pi * w)


@_formula
def coaxial_disks(radius_1: _Positive, radius_2: _Positive, distance: _Positive) -> Array:
    """From a disk to one in a parallel plane with the same axis (C-41).

    F = ½ (S − √(S² − 4 (r₂/r₁)²)), S = 1 + (r₂² + h²)/r₁²; computed as 2 (r₂/r₁)²/(S + √...), which keeps digits.

    Shapes broadcast. Units any length -> 1. Error rounding, relative too.
    Source The integral of `point_to_disk` over the first disk.

    Example
    >>> print(gn.radiometry.form_factors.coaxial_disks(1.0, 1.0, distance=1.0).round(6))
    0.381966
    """
    square = radius_1 * radius_1 + radius_2 * radius_2 + distance * distance
    root = np.hypot(radius_1 - radius_2, distance) * np.hypot(radius_1 + radius_2, distance)
    return 2.0 * radius_2 * radius_2 / (square + root)


# Spheres


@_formula
def sphere_to_disk(radius: _NotNegative, distance: _Positive) -> Array:
    """From a sphere to a disk of this radius, whose axis goes through the centre at this distance.

    F = ½ (1 − h/√(h²+r²)), whatever the sphere's own radius, if the disk's plane does not cut it.

    Shapes broadcast. Units any length -> 1. Error rounding, relative too for small disks.
    Source By symmetry the disk's solid angle from the centre, over 4π.

    Example
    >>> print(gn.radiometry.form_factors.sphere_to_disk(1.0, distance=1.0).round(4))
    0.1464
    """
    far = np.hypot(radius, distance)
    return 0.5 * np.square(radius / far) / (1.0 + distance / far)


@_formula
def sphere_to_rectangle(a: _NotNegative, b: _NotNegative, distance: _Positive) -> Array:
    """From a sphere to a rectangle a × b, one corner of which is nearest to the sphere's centre, at this distance.

    F = 1/(4π) atan(ab/(c √(a²+b²+c²))), whatever the sphere's own radius, if the rectangle's plane does not cut it.

    Shapes broadcast. Units any length -> 1. Error rounding, relative too.
    Source By symmetry the rectangle's solid angle from the centre, over 4π.

    Example
    >>> print(gn.radiometry.form_factors.sphere_to_rectangle(1.0, 1.0, distance=1.0).round(6))
    0.041667
    """
    return np.arctan2(a * b, distance * np.hypot(np.hypot(a, b), distance)) / (4.0 * np.pi)


@_formula
def concentric_spheres(radius: _Positive, outer: _Positive) -> Array:
    """From the inside of a sphere to a smaller one within: F = (r/R)²; the rest, 1 − F, returns to the outer sphere.

    It holds for eccentric spheres too, and with r/R for infinite cylinders, one within the other.

    Shapes broadcast. Units any length -> 1. Error rounding, relative too.
    Source A1 F12 = A2 F21, and all that a convex body sends out arrives at what encloses it.

    Example
    >>> print(gn.radiometry.form_factors.concentric_spheres(1.0, outer=2.0))
    0.25
    """
    if np.any(radius > outer):
        raise ParameterError("radius must be at most outer, got more: the first sphere is within the second")
    return np.square(radius / outer)


@_formula
def spherical_cavity(half_angle: _Polar) -> Array:
    """From the inside of a spherical cap to itself: F = sin²(a/2), a from the centre to the rim; ½ for a hemisphere.

    Every patch of a sphere receives the same from every other: F is the cap's share of the whole sphere.

    Shapes any. Units rad -> 1. Error rounding, relative too.
    Source cosθ₁ cosθ₂/(π r²) = 1/(4π R²) for any two points of a sphere.

    Example
    >>> print(gn.radiometry.form_factors.spherical_cavity(np.pi / 2).round(4))
    0.5
    """
    return np.square(np.sin(0.5 * half_angle))


@_formula
def conical_cavity(radius: _Positive, depth: _NotNegative) -> Array:
    """From the inside of a cone to itself: F = 1 − r/√(r²+h²), with the radius of its opening and its depth.

    Shapes broadcast. Units any length -> 1. Error rounding.
    Source All that the opening would send in arrives: A1 (1 − F) = A of the opening.

    Example
    >>> print(gn.radiometry.form_factors.conical_cavity(3.0, depth=4.0).round(4))
    0.4
    """
    slant = np.hypot(radius, depth)
    return np.square(depth) / (slant * (slant + radius))


# Cylinders


@_formula
def cylinder_to_base(radius: _Positive, height: _Positive) -> Array:
    """From the inside of a cylinder to one of its ends: F = ½ (√(1+H²) − H), H = h/(2r).

    Shapes broadcast. Units any length -> 1. Error rounding, relative too.
    Source `coaxial_disks` of the two ends, by reciprocity and the sum of an end's factors.

    Example
    >>> print(gn.radiometry.form_factors.cylinder_to_base(1.0, height=2.0).round(4))
    0.2071
    """
    half = 0.5 * height / radius
    return 0.5 / (np.hypot(1.0, half) + half)


@_formula
def cylinder_to_itself(radius: _Positive, height: _NotNegative) -> Array:
    """From the inside of a cylinder, whose ends are open, to itself: F = 1 + H − √(1+H²), H = h/(2r).

    Shapes broadcast. Units any length -> 1. Error rounding, relative too.
    Source 1 less `cylinder_to_base` for both ends.

    Example
    >>> print(gn.radiometry.form_factors.cylinder_to_itself(1.0, height=2.0).round(4))
    0.5858
    """
    half = 0.5 * height / radius
    return 2.0 * half / (1.0 + half + np.hypot(1.0, half))


@_formula
def parallel_cylinders(radius: _Positive, gap: _NotNegative) -> Array:
    """Between two infinite cylinders of equal radius, side by side: F = (√(X²−1) + asin(1/X) − X)/π, X = 1 + s/(2r).

    Shapes broadcast. Units any length -> 1. Error rounding, relative too.
    Source Hottel's crossed strings around both.

    Example
    >>> print(gn.radiometry.form_factors.parallel_cylinders(1.0, gap=0.0).round(4))
    0.1817
    """
    rest = 0.5 * gap / radius
    x = 1.0 + rest
    return (np.arctan2(1.0, np.sqrt(rest * (rest + 2.0))) - 1.0 / (x + np.sqrt(rest * (rest + 2.0)))) / np.pi


@_formula
def plane_to_tubes(diameter: _Positive, spacing: _Positive) -> Array:
    """From an infinite plane to a row of parallel tubes in front of it: F = 1 − √(1−D²) + D acos D, D = d/spacing.

    Shapes broadcast. Units any length -> 1. Error rounding.
    Source Hottel's crossed strings between neighbouring tubes.

    Example
    >>> print(gn.radiometry.form_factors.plane_to_tubes(1.0, spacing=2.0).round(4))
    0.6576
    """
    if np.any(diameter > spacing):
        raise ParameterError("diameter must be at most spacing, got more: tubes do not overlap")
    d = diameter / spacing
    root = np.sqrt((1.0 - d) * (1.0 + d))
    return d * d / (1.0 + root) + d * np.arctan2(root, d)


# Infinite strips


@_formula
def parallel_strips(width_1: _Positive, width_2: _Positive, distance: _Positive) -> Array:
    """From an infinitely long strip to a parallel one straight opposite it (C-2).

    F = (√((w₁+w₂)² + 4h²) − √((w₂−w₁)² + 4h²))/(2w₁), distance h; computed as 2w₂ over the sum of the roots.

    Shapes broadcast. Units any length -> 1. Error rounding, relative too.
    Source Hottel's crossed strings: half the crossed ones less the others, over the width.

    Example
    >>> print(gn.radiometry.form_factors.parallel_strips(1.0, 1.0, distance=1.0).round(4))
    0.4142
    """
    crossed, outer = (np.hypot(width, 2.0 * distance) for width in (width_1 + width_2, width_2 - width_1))
    return 2.0 * width_2 / (crossed + outer)


@_formula
def strips_at_angle(width_1: _Positive, width_2: _Positive, angle: _Polar) -> Array:
    """From an infinitely long strip to one that shares an edge with it, at this angle between them.

    F = (w₁ + w₂ − √(w₁² + w₂² − 2w₁w₂ cos a))/(2w₁); for equal widths 1 − sin(a/2).

    Shapes broadcast. Units any length, rad -> 1. Error rounding.
    Source Hottel's crossed strings; one of the others has no length.

    Example
    >>> print(gn.radiometry.form_factors.strips_at_angle(1.0, 1.0, angle=np.pi / 2).round(4))
    0.2929
    """
    third = np.hypot(width_1 - width_2, 2.0 * np.sqrt(width_1) * np.sqrt(width_2) * np.sin(0.5 * angle))
    return 2.0 * width_2 * np.square(np.cos(0.5 * angle)) / (width_1 + width_2 + third)


# Polygons


@_formula
def polygon_to_polygon(vertices_1: _Polygon, vertices_2: _Polygon) -> Array:
    """From a plane polygon to another, anywhere: F12 = 1/(2π A₁) ∮∮ ln r dr₁·dr₂ along the two outlines.

    Both send and receive on the side from which their corners go counterclockwise; what is behind the plane of the
    other is cut off. Nothing stands between them. The integral along one outline has a closed form; along the other
    it is Gauss's, or, where the outlines are near or touch, tanh-sinh between the places that are nearest.

    Shapes vertices (..., V, 3) and (..., W, 3) in order -> ... Units any length -> 1.
    Error  absolute: 1e-15 of polygons apart or sharing an edge at 0.01 to 3.1 rad; 2e-13 of strips that share an
           edge a hundred times longer than they are wide.
    Raises ParameterError for polygons without area, not plane to 1e-6 of their size, or cut into several parts.
    Source Stokes' theorem, twice: Sparrow 1963, J. Heat Transfer 85:81; the inner integral is elementary.

    Example
    >>> floor = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]])
    >>> ceiling = floor[::-1] + [0.0, 0.0, 1.0]
    >>> print(gn.radiometry.form_factors.polygon_to_polygon(floor, ceiling).round(6))
    0.199825
    """
    shape = np.broadcast_shapes(vertices_1.shape[:-2], vertices_2.shape[:-2])
    dtype = vertices_1.dtype
    both = []
    for name, vertices in (("vertices_1", vertices_1), ("vertices_2", vertices_2)):
        whole = np.broadcast_to(vertices, (*shape, *vertices.shape[-2:])).reshape(-1, *vertices.shape[-2:])
        both.append((name, whole.astype(np.float64)))
    if not len(both[0][1]):
        return np.zeros(shape, dtype)
    return exchanged(both[0], both[1]).reshape(shape).astype(dtype)[()]


__all__, __dir__ = own_names(globals())

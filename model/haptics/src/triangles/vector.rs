//! Vectors of three numbers.

pub(super) use crate::surface::dot;

pub(super) type Vector = [f64; 3];

#[inline(always)]
pub(super) fn minus(a: Vector, b: Vector) -> Vector {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// `a + share b`.
#[inline(always)]
pub(super) fn plus(a: Vector, share: f64, b: Vector) -> Vector {
    [a[0] + share * b[0], a[1] + share * b[1], a[2] + share * b[2]]
}

/// Exactly opposite for exchanged vectors: each part is one difference of two products.
#[inline(always)]
pub(super) fn cross(a: Vector, b: Vector) -> Vector {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

#[inline(always)]
pub(super) fn length(a: Vector) -> f64 {
    dot(a, a).sqrt()
}

/// Of length one; `None` where there is no direction.
pub(super) fn unit(a: Vector) -> Option<Vector> {
    let length = length(a);
    (length > 0.0 && length.is_finite()).then(|| a.map(|part| part / length))
}

/// Angle between two vectors in rad, exact to rounding for small angles too.
pub(super) fn angle(a: Vector, b: Vector) -> f64 {
    length(cross(a, b)).atan2(dot(a, b))
}

pub(super) fn is_finite(a: Vector) -> bool {
    a.iter().all(|part| part.is_finite())
}

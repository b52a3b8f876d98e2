"""An affine camera, fitted to what it has seen of points whose places are known.  Pure.

    p  place of the tip by the described links, cm: x and y, or x, y and z
    s  image features, px: u and v
    W  s = W (1, p): rows of an offset, px, and of px/cm for each axis
    C  covariance of each row of W without its offset, (px/cm)^2

As complex numbers, z = u + iv = o + a.p: one vector a instead of two rows.  Least squares about the
means give a = S^-1 b with S = sum w (p - mean p) (p - mean p)' and b = sum w (p - mean p)
(z - mean z); its covariance is S^-1 for each row.

What a camera may be is known before: its pixels are square, so one that looks at things from afar
is a scaled orthographic projection (Horaud, Dornaika, Lamiroy and Christy 1997), whose rows are
as long as each other and at right angles:

    a.a = |a_u|^2 - |a_v|^2 + 2i a_u.a_v = 0

In space that leaves 6 numbers of 8, and in a plane that is seen from its front 4 of 6: a =
d (1, -i), the similarity, where y is turned round since v runs down.  Then the motion of one joint
predicts the others.  Perspective and a tilted view of a plane deviate from it, by a share of |a|.
So it is a soft constraint: it helps where a few frames leave a direction open, and many outweigh
it.  In a plane the fit is drawn towards the similarity that fits best.

In space it is taken in as a measurement h(a) = a.a of 0 with the variance R, by an iterated
extended Kalman filter (Bell and Cathey 1993): linear about the present a_k, from the a0 of least
squares alone,

    a = a0 - w (a_k.a_k + 2 a_k.(a0 - a_k)) / 2 (a_k.w + r),   w = S^-1 conj(a_k),   r = R / 8

and the covariance S^-1 - Re(w w^H) / (a.w + r): what is known of one row is known of the other.
"""

MYPY = False  # which a type checker takes for true
if MYPY:
    from typing import Tuple  # noqa: F401

    from robot.servoing.linear_algebra import Matrix, Vector  # noqa: F401

    Camera = Tuple[Matrix, Matrix]  # W and C

SCALE_SIGMA = 20.0
"""Standard deviation of the image's scale before anything is known of it, px/cm."""

OFFSET_SIGMA = 1e4
"""Standard deviation of where the base is seen, px."""

SKEW_SHARE, MIN_SKEW = 0.25, 1.0
"""Standard deviation of an image's deviation from a scaled orthographic one, as a share of its
scale, and the least, px/cm: a tilted plane is foreshortened, and perspective looks from a slant."""

ITERATIONS = 3
"""Linearizations of the constraint in space."""


def planar_camera(sums):
    # type: (Vector) -> Camera
    """Fit a camera that sees a plane.

    A mirrored picture is further from what is known before, and takes more frames.

    Args:
        sums: sum w t t', its lower triangle row by row, and sum w t u, sum w t v, with t = (1, x,
            y) and w in px^-2.
    """
    n, x, xx, y, xy, yy, u, xu, yu, v, xv, yv = sums
    n += 1 / OFFSET_SIGMA**2
    z = complex(u, v) / n
    bx, by = complex(xu, xv) - x * z, complex(yu, yv) - y * z
    x, y, sx, sy = x / n, y / n, x, y
    xx, xy, yy = xx - x * sx, xy - x * sy, yy - y * sy
    spread = xx + yy + 1 / SCALE_SIGMA**2
    d = (bx + 1j * by) / spread
    precision = 1 / (SKEW_SHARE**2 * (d.real * d.real + d.imag * d.imag) + MIN_SKEW**2)
    d *= precision
    xx, yy, bx, by = xx + precision, yy + precision, bx + d, by - 1j * d
    det = xx * yy - xy * xy
    ax, ay = (yy * bx - xy * by) / det, (xx * by - xy * bx) / det
    z -= x * ax + y * ay
    xy /= -det
    C = (yy / det + 1 / spread, xy), (xy, xx / det + 1 / spread)
    return ([z.real, ax.real, ay.real], [z.imag, ax.imag, ay.imag]), C


def spatial_camera(sums):
    # type: (Vector) -> Camera
    """Fit a camera that sees space; `sums` as for planar_camera, with t = (1, x, y, z)."""
    n, x, xx, y, xy, yy, z, xz, yz, zz, u, xu, yu, zu, v, xv, yv, zv = sums
    n += 1 / OFFSET_SIGMA**2
    o = complex(u, v) / n
    bx, by, bz = complex(xu, xv) - x * o, complex(yu, yv) - y * o, complex(zu, zv) - z * o
    x, y, z, sx, sy, sz = x / n, y / n, z / n, x, y, z
    precision = 1 / SCALE_SIGMA**2
    xx, yy, zz = xx - x * sx + precision, yy - y * sy + precision, zz - z * sz + precision
    xy, xz, yz = xy - x * sy, xz - x * sz, yz - y * sz
    # S^-1, by cofactors
    cxx, cxy, cxz = yy * zz - yz * yz, xz * yz - xy * zz, xy * yz - xz * yy
    det = xx * cxx + xy * cxy + xz * cxz
    cxx, cxy, cxz = cxx / det, cxy / det, cxz / det
    cyy, cyz, czz = (xx * zz - xz * xz) / det, (xy * xz - xx * yz) / det, (xx * yy - xy * xy) / det
    ax = a = cxx * bx + cxy * by + cxz * bz
    ay = b = cxy * bx + cyy * by + cyz * bz
    az = c = cxz * bx + cyz * by + czz * bz
    for _ in range(ITERATIONS):
        p, q, r = a.conjugate(), b.conjugate(), c.conjugate()
        size = (a * p + b * q + c * r).real
        wx, wy, wz = (
            cxx * p + cxy * q + cxz * r, cxy * p + cyy * q + cyz * r, cxz * p + cyz * q + czz * r
        )  # fmt: skip
        gain = (a * wx + b * wy + c * wz).real
        gain = 1 / (gain + size * (SKEW_SHARE**2 / 2 * size + MIN_SKEW**2) + 1e-12)
        step = gain * (a * ax + b * ay + c * az - (a * a + b * b + c * c) / 2)
        a, b, c = ax - step * wx, ay - step * wy, az - step * wz
    o -= x * a + y * b + z * c
    W = [o.real, a.real, b.real, c.real], [o.imag, a.imag, b.imag, c.imag]
    p, q, r = gain * wx.conjugate(), gain * wy.conjugate(), gain * wz.conjugate()
    cxy, cxz, cyz = cxy - (p * wy).real, cxz - (p * wz).real, cyz - (q * wz).real
    cxx, cyy, czz = cxx - (p * wx).real, cyy - (q * wy).real, czz - (r * wz).real
    return W, ((cxx, cxy, cxz), (cxy, cyy, cyz), (cxz, cyz, czz))

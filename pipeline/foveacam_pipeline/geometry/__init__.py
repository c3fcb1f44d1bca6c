"""Rays, angles, pinholes, triangulation, bivariate polynomials: pure functions."""

from foveacam_pipeline.geometry.angles import (
    angles_from_rays,
    angles_from_tan,
    ray,
    rays_from_angles,
    tan_from_angles,
)
from foveacam_pipeline.geometry.plane_window import (
    PinholeWindow,
    homography_apply,
)
from foveacam_pipeline.geometry.polynomial import (
    BivariatePolynomial,
    PolynomialFit,
    fit_best_order,
    fit_polynomial,
    monomials,
)
from foveacam_pipeline.geometry.triangulate import (
    RayIntersection,
    closest_approach,
    depth_from_disparity_m,
    depth_sigma_m,
    points_from_plane,
    range_sigma_m,
)
from foveacam_pipeline.geometry.verging import (
    eye_angles,
    point_from_direction,
    point_on_ray,
    vergence_angles,
)

__all__ = [
    "BivariatePolynomial",
    "PinholeWindow",
    "PolynomialFit",
    "RayIntersection",
    "angles_from_rays",
    "angles_from_tan",
    "closest_approach",
    "depth_from_disparity_m",
    "depth_sigma_m",
    "eye_angles",
    "fit_best_order",
    "fit_polynomial",
    "homography_apply",
    "monomials",
    "point_from_direction",
    "point_on_ray",
    "points_from_plane",
    "range_sigma_m",
    "ray",
    "rays_from_angles",
    "tan_from_angles",
    "vergence_angles",
]

"""Rays, angles, pinholes, triangulation, bivariate polynomials: pure functions."""

"""Inverse kinematics: closed forms of nominal arms as starts (`closed_form`), and damped Newton steps on the calibrated
arm that end at the wanted pose or report that it cannot be reached (`solve`).
"""

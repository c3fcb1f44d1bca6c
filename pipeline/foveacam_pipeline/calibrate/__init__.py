"""The procedures and fits that calibrate a rig.

Nothing is imported here, so that a server starts without scipy (the fits) and matplotlib (the pictures).
"""

"""The procedures and fits that calibrate a rig.

Nothing is imported here: the fits load scipy, the pictures matplotlib, and a server shall start without them.
"""

"""What commands of `foveacam` share (options about the rig, its opening), and `foveacam calibrate`.

`calibrate` is here because it spans four resources.
"""

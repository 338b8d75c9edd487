"""Writes a catkin package for a robot of the user's: scripts/new_robot.py, and nobody else imports it.

`cli` reads the command line, `names` checks the package's name, `urdf_files` copies the URDF with what it
includes, `survey` says what it is made of, `gains` what moves its joints, `ground` how high it stands,
`contents` what the package says, and `template/` is how it says so. Knows no robot by name.
"""

"""The mechanism: Denavit-Hartenberg kinematics, links, joints, drives, and the chain that they form."""

"""All that is changed inside rospy, or reached by its private names: rospy offers no other way to it.

Each function is one patch, for the simulator's own node and for its process only. All were seen to be
needed with rospy 1.15.15 (Debian 12); each module says why, and which test holds it.

Classes that merely override a method stand where they are used: `SteadyActionServer` (actionlib),
`DynamicServer` (dynamic_reconfigure), and `model_services.py`'s response without a header.
"""

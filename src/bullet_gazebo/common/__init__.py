"""What the node and its clients share on top of rospy.

The modules `rospy_*` change rospy itself or reach into it, because it offers no other way. They are meant
for this process only, and were needed with rospy 1.15.15 (Debian 12); each says which defect it mends and
which test shows it. Classes that merely override a method of rospy, actionlib or dynamic_reconfigure are
where they are used.
"""

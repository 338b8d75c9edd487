"""Other nodes that a script starts: those written with rospy follow its clock."""

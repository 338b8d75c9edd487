"""Between rospy and the rest: messages, connections, signals, thinning."""

"""Models as objects of a web page of viser's; knows no ROS."""

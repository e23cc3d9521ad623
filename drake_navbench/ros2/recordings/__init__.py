"""Trials as recordings of ROS 2 and of plain tools, and recordings of real robots as trials.

The library `rosbags` is the extra `bags`; it is imported where a bag is opened, nowhere else.
"""

"""Viewports, their keypoints, and the cameras solved from them."""

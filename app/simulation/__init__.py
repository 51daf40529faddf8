"""The demo harbour: scenes, ships, AIS traffic and the exact truth of every vessel.

Photographs of real harbours come without truth: nobody knows where a ship was to the decimetre.
A harbour made from a seed knows. It serves the demo, the tests and the accuracy benchmark, and it
imports neither matching nor fusion, so that truth cannot copy what it is to judge.
"""

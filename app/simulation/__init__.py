"""The demo harbour: scenes, ships, AIS traffic and the exact truth of every vessel.

Photographs of real harbours come without truth: nobody knows where a ship was to the decimetre.
A harbour made from a seed knows. It serves the demo, the tests and the accuracy benchmark, and it
imports neither matching nor fusion, so that truth cannot copy what it is to judge.

Begin with `harbour.make_harbour`. From there: `scenery` and `structures` build the land, `ships`,
`ship_plans`, `hulls` and `fittings` the fleet; `traffic` and `motion` send it on its way,
`transmissions` lets it speak AIS; `raster` turns faces into pixels, `painter` with `light`, `sky`,
`water` and `wakes` makes a picture of them, `truth` and `detections` say what is in it.
"""

from pathlib import Path

DETECTOR_FILE = Path(__file__).with_name("harbour_yolox_nano.onnx")

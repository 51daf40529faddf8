"""The demo harbour: scenes, ships, AIS traffic and the exact truth of every vessel.

Photographs of real harbours come without truth: nobody knows where a ship was to the decimetre.
A harbour made from a seed knows. It serves the demo, the tests and the accuracy benchmark, and it
imports neither matching nor fusion, so that truth cannot copy what it is to judge.

Whoever judges something with it needs four names::

    from app.simulation.harbour import make_harbour
    from app.simulation.settings import HarbourSettings, TrafficSettings
    from app.simulation.ship_plans import Fleet

    settings = HarbourSettings(traffic=TrafficSettings.perfect(), fleet=Fleet.JUDGING)
    harbour = make_harbour(seed=7, image_count=24, width_px=1280, height_px=960, settings=settings)

- `harbour.site` has origin and water level, `harbour.frame` is the local ENU frame in which true
  cameras and truth are given, `harbour.landmarks` are named places (WGS84).
- `harbour.camera` is the camera: `intrinsics` with K and distortion, and `viewports`, each with its
  time of validity, its true `camera` and the `keypoints` that someone clicked about a pixel off.
- `harbour.nmea_text()` is what the AIS receiver heard, line by line with arrival times.
- `harbour.frames` are the images to come: `captured_at`, `viewport`, true `water_level_m`;
  `frame.render()` gives the pixels (height, width, 3) BGR, `frame.truth` a `VesselTruth` for every
  vessel that reaches into the image, hidden or not: pose, box and its 8 corners in ENU and in
  pixels, silhouette boxes of what shows and of the whole, visible fraction, the paper's class, MMSI
  where it sends AIS. `frame.observe()` gives both more cheaply, `frame.detections` boxes as a
  detector of known quality would give them (`settings.DetectorSettings`).

The same arguments give the same harbour, in any process and whatever is rendered first.
`DETECTOR_FILE` is a real detector, trained on such images (its card stands beside it).

Inside, `scenery`, `structures` and `clutter` build the land, `ships`, `ship_plans`, `hulls` and
`fittings` the fleet; `traffic` and `motion` send it on its way, `transmissions` lets it speak AIS;
`raster` turns faces into pixels, `painter` with `light`, `shadows`, `sky`, `water`, `mirror`,
`wakes` and `skin` makes a picture of them, `truth` says what is in it.
"""

from pathlib import Path

DETECTOR_FILE = Path(__file__).with_name("harbour_yolox_nano.onnx")

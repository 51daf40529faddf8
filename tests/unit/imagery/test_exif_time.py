"""When a photograph was taken, by its EXIF."""

from datetime import timedelta

import pytest
from PIL import ExifTags, Image

from app.imagery.exif_time import taken

TAG, GPS = ExifTags.Base, ExifTags.GPS
ORIGINAL, OFFSET = TAG.DateTimeOriginal, TAG.OffsetTimeOriginal
SHOWN = "2026:07:31 10:11:12"
SATELLITES = {GPS.GPSDateStamp: "2026:07:31", GPS.GPSTimeStamp: (8.0, 11.0, 10.0)}
OLD_FIX = {GPS.GPSDateStamp: "2026:07:31", GPS.GPSTimeStamp: (8.0, 4.0, 0.0)}


@pytest.mark.parametrize(
    ("details", "satellites", "offset_h"),
    [
        ({ORIGINAL: SHOWN}, {}, None),
        ({ORIGINAL: SHOWN, OFFSET: "+05:45"}, {}, 5.75),
        ({ORIGINAL: SHOWN, TAG.OffsetTime: "-03:00"}, SATELLITES, -3),
        ({ORIGINAL: SHOWN, OFFSET: "+23:00"}, {}, None),
        ({ORIGINAL: SHOWN, OFFSET: "   :  "}, {}, None),
        ({ORIGINAL: SHOWN}, SATELLITES, 2),
        ({ORIGINAL: SHOWN}, OLD_FIX, None),
        ({ORIGINAL: "2026-07-31T10:11:12Z"}, {}, 0),
        ({ORIGINAL: "0000:00:00 00:00:00", TAG.DateTimeDigitized: SHOWN}, {}, None),
        ({TAG.DateTime: SHOWN}, {}, None),
    ],
)
def test_the_moment_and_its_zone_are_read(
    details: dict[int, str], satellites: dict[int, object], offset_h: float | None
) -> None:
    """Other tags than the usual, other separators and the satellites' time tell what they can."""
    found = taken(photograph(details, satellites))
    assert found is not None
    assert found.replace(tzinfo=None).isoformat(" ", "seconds") == "2026-07-31 10:11:12"
    assert found.utcoffset() == (None if offset_h is None else timedelta(hours=offset_h))


@pytest.mark.parametrize(
    "rubbish",
    [
        "0000:00:00 00:00:00",
        "    :  :     :  :  ",
        "2026:07:31 24:00:00",
        "2026:06:30 23:59:60",
        "2026",
    ],
)
def test_rubbish_tells_nothing(rubbish: str) -> None:
    """What is no moment is none, rather than a wrong one."""
    assert taken(photograph({ORIGINAL: rubbish}, {})) is None


def photograph(details: dict[int, str], satellites: dict[int, object]) -> Image.Image:
    """Return a picture with EXIF."""
    picture = Image.new("L", (1, 1))
    exif = picture.getexif()
    exif.get_ifd(ExifTags.IFD.Exif).update(details)
    exif.get_ifd(ExifTags.IFD.GPSInfo).update(satellites)
    return picture
